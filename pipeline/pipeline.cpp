#include "pipeline/pipeline.h"

#include <chrono>
#include <cstdlib>
#include <fstream>
#include <set>
#include <sstream>

#include <fmt/format.h>
#include <fnmatch.h>

#include "pipeline/digest.h"
#include "pipeline/ledger.h"
#include "pipeline/schedule.h"
#include "pipeline/settings.h"
#include "pipeline/spelling.h"
#include "pipeline/who_and_when.h"

namespace geocage::pipeline {

namespace fs = std::filesystem;

namespace {

using Clock = std::chrono::steady_clock;
double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

/// The digest of the running program, for the record.
const std::string& program_digest() {
  static const std::string digest = sha256_of_file("/proc/self/exe");
  return digest;
}

/// A stage's Run that speaks to the watcher.
class WatchedRun : public Run {
 public:
  WatchedRun(Watcher& watcher, std::string slot) : watcher_(watcher), slot_(std::move(slot)) {}
  void log(std::string_view sentence) override { watcher_.log(slot_, sentence); }
  void progress(std::size_t done, std::size_t total) override { watcher_.progress(slot_, done, total); }

 private:
  Watcher& watcher_;
  std::string slot_;
};

/// The Run of a stage in a worker process: what it says is noted in a folder, for take_notes.
class NotingRun : public Run {
 public:
  explicit NotingRun(const fs::path& folder) : folder_(folder), log_(folder / "log") {}
  void log(std::string_view sentence) override { log_ << sentence << "\n"; }
  void progress(std::size_t done, std::size_t total) override { tell_how_far(done, total); }
  void finish() {
    log_.close();
    std::ofstream out(folder_ / "metrics");
    for (const auto& [name, value] : metrics()) out << fmt::format("{} {}\n", value, name);
  }

 private:
  fs::path folder_;
  std::ofstream log_;
};

void take_notes(const fs::path& folder, const std::string& slot, Run& run, Watcher& watcher) {
  std::ifstream log(folder / "log"), metrics(folder / "metrics");
  for (std::string line; std::getline(log, line);) watcher.log(slot, line);
  for (std::string line; std::getline(metrics, line);) {
    const auto gap = line.find(' ');
    run.metric(line.substr(gap + 1), std::strtod(line.c_str(), nullptr));  // fmt's shortest digits read back
  }
}

bool matches(const Node& node, const std::string& pattern) {
  return node.slot == pattern || node.stage == pattern || node.slot.starts_with(pattern + "/") ||
         fnmatch(pattern.c_str(), node.slot.c_str(), 0) == 0;
}

/// The part of a recipe line that names what it is about: "param sweeps", "input 1", "version".
std::string subject(const std::string& line) {
  if (const auto equals = line.find(" = "); equals != std::string::npos) return line.substr(0, equals);
  const auto words = line.starts_with("input ") ? line.find(' ', 6) : line.find(' ');
  return line.substr(0, words);
}

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

std::string difference(const std::string& old_recipe, const std::string& new_recipe) {
  std::map<std::string, std::string> before, after;
  for (const auto& line : lines_of(old_recipe)) before[subject(line)] = line;
  for (const auto& line : lines_of(new_recipe)) after[subject(line)] = line;
  std::string text;
  for (const auto& [name, line] : before)
    if (const auto it = after.find(name); it == after.end())
      text += "  - " + line + "\n";
    else if (it->second != line)
      text += "  - " + line + "\n  + " + it->second + "\n";
  for (const auto& [name, line] : after)
    if (!before.contains(name)) text += "  + " + line + "\n";
  return text;
}

std::string_view word(Fault fault) {
  switch (fault) {
    case Fault::configuration:
      return "configuration";
    case Fault::input:
      return "input";
    case Fault::geometry:
      return "geometry";
    case Fault::store:
      return "store";
  }
  return "";
}

/// Of the exception under way.
void describe_failure(SlotResult& result) {
  result.state = SlotState::failed;
  try {
    throw;
  } catch (const WorkerLost& error) {
    result.sentence = error.what();
    result.code = word(error.loss());
  } catch (const UserError& error) {
    result.sentence = error.what();
    result.code = word(error.fault());
  } catch (const std::exception& error) {
    result.sentence = std::string("error: the stage failed: ") + error.what();
    result.code = word(Loss::exception);
  }
}

/// The first kind of difference between two recipes, in words.
std::string kind_of_change(const std::string& before, const std::string& after) {
  const std::string changes = difference(before, after);
  const auto has = [&](const char* line) {
    return changes.find(std::string("+ ") + line) != std::string::npos;
  };
  std::string kinds;
  const auto add = [&](const char* line, const char* kind) {
    if (has(line)) kinds += (kinds.empty() ? "" : ", ") + std::string(kind);
  };
  add("version ", "version changed");
  add("param ", "parameter changed");
  add("input ", "input changed");
  return kinds.empty() ? "its artefact is gone" : kinds;
}

}  // namespace

std::string_view word(SlotState state) {
  constexpr std::string_view words[] = {"made", "hit", "failed", "skipped"};
  return words[static_cast<int>(state)];
}

std::string parameter_lines(const Fields& fields) {
  std::string lines;
  for (const Field& field : fields.list()) lines += "param " + field.name + " = " + value_text(field) + "\n";
  return lines;
}

Node& Pipeline::add_node(const std::string& slot) {
  if (by_slot_.contains(slot)) throw UserError(Fault::configuration, slot, "this slot is there twice");
  nodes_.push_back(std::make_unique<Node>());
  nodes_.back()->slot = slot;
  by_slot_[slot] = nodes_.back().get();
  return *nodes_.back();
}

Node& Pipeline::node(const std::string& slot) {
  if (const auto known = by_slot_.find(slot); known != by_slot_.end()) return *known->second;
  throw UserError(Fault::configuration, slot, "there is no such slot" + did_you_mean(slot, slots()));
}

std::vector<std::string> Pipeline::slots() const {
  std::vector<std::string> names;
  for (const auto& known : nodes_)
    if (!known->constant) names.push_back(known->slot);
  return names;
}

std::vector<std::string> Pipeline::matching(const std::string& pattern) const {
  std::vector<std::string> found;
  for (const auto& known : nodes_)
    if (!known->constant && matches(*known, pattern)) found.push_back(known->slot);
  if (found.empty())
    throw UserError(Fault::configuration, pattern, "no slot matches" + did_you_mean(pattern, slots()),
                    "geocage status lists the slots");
  return found;
}

std::optional<std::string> Pipeline::recipe_of(const Node& node) const {
  std::string recipe = fmt::format("geocage-recipe 1\nstage {}\nversion {}\noutput {}\n{}", node.stage,
                                   node.version, node.kind, node.parameters);
  for (std::size_t i = 0; i < node.inputs.size(); ++i) {
    const Node& input = *node.inputs[i];
    if (!input.content) return {};
    recipe += fmt::format("input {} {} {}\n", i + 1, input.kind, *input.content);
  }
  return recipe;
}

void Pipeline::note(const Node& node, const std::string& recipe) const {
  const std::string key = sha256_of(recipe);
  const auto before = store_.slot(node.slot);
  if (before && before->key == key && before->content == *node.content) return;
  const std::string previous = !before ? "" : before->key == key ? before->previous_recipe : before->recipe;
  store_.write_slot(node.slot, {key, *node.content, recipe, previous});
}

/// Answers the worker's peak memory [GiB].
double Pipeline::make_contained(Node& node, Run& run, const fs::path& scratch, Watcher& watcher) {
  const auto work = [&](const fs::path& folder) {
    NotingRun noting(folder);
    if (guard_->prepare) guard_->prepare(*node.share);
    node.make(noting, scratch);
    noting.finish();
  };
  const auto collect = [&](const fs::path& folder) { take_notes(folder, node.slot, run, watcher); };
  const auto hear = [&](std::size_t done, std::size_t total) { run.progress(done, total); };
  return run_contained(guard_->limits, node.slot, work, collect, hear).peak_memory_gib;
}

void Pipeline::make(Node& node, const std::string& recipe, Watcher& watcher) {
  WatchedRun run(watcher, node.slot);
  const auto start = Clock::now();
  const auto scratch = store_.scratch();
  Record record;
  try {
    if (guard_)
      record.peak_memory_gib = make_contained(node, run, scratch, watcher);
    else
      node.make(run, scratch);
  } catch (...) {
    std::filesystem::remove_all(scratch);
    throw;
  }
  record.recipe = recipe;
  record.content = store_.publish(scratch);
  record.metrics = run.metrics();
  record.seconds = seconds_since(start);
  record.made_at = now_utc();
  record.host = host_name();
  record.program = program_digest();
  if (const auto before = store_.find(record.key()); before && before->content != record.content)
    watcher.log(node.slot, "this stage answered otherwise than before: it depends on more than its recipe");
  store_.write(record);
  accept(node, record, SlotState::made);
}

void Pipeline::accept(Node& node, const Record& record, SlotState state) const {
  node.content = record.content;
  node.result.state = state;
  node.result.metrics = record.metrics;
  node.result.made_seconds = record.seconds;
  node.result.peak_memory_gib = record.peak_memory_gib;
  node.result.folder = store_.folder(record.content);
}

void Pipeline::settle(Node& node, bool forced, Watcher& watcher) {
  const auto start = Clock::now();
  const std::string recipe = *recipe_of(node);
  const std::string key = sha256_of(recipe);
  const auto take = [&] {
    const auto record = store_.find(key);
    if (!record) return false;
    if (!store_.check(record->content)) {
      watcher.log(node.slot, "its artefact was damaged: it is in quarantine and made anew");
      return false;
    }
    accept(node, *record, SlotState::hit);
    return true;
  };
  if (forced || !take()) {
    if (!forced && failed_before(node, key)) return;
    const FileLock lock(store_.root() / "locks" / key);
    try {
      if (forced || !take()) make(node, recipe, watcher);  // another process may have made it meanwhile
    } catch (const std::system_error&) {
      throw;
    } catch (...) {
      describe_failure(node.result);
      keep_failure(node, key);
      node.failed_here = true;
      node.result.seconds = seconds_since(start);
      return;
    }
    if (guard_) Ledger(store_).forget(node.slot);
  }
  note(node, recipe);
  node.result.seconds = seconds_since(start);
}

namespace {
void recall(const Failure& failure, SlotResult& result) {
  result.state = SlotState::failed;
  result.sentence = failure.sentence;
  result.code = failure.code;
  result.known = true;
}
}  // namespace

bool Pipeline::failed_before(Node& node, const std::string& key) const {
  if (!guard_ || guard_->retry_failed) return false;
  const auto failure = Ledger(store_).find(node.slot);
  if (!failure || failure->key != key || failure->program != program_digest()) return false;
  recall(*failure, node.result);
  node.result.known = !node.failed_here;
  return true;
}

void Pipeline::keep_failure(const Node& node, const std::string& key) const {
  if (!guard_) return;
  std::string inputs;
  for (const Node* input : node.inputs) inputs += (inputs.empty() ? "" : " ") + *input->content;
  const std::string command =
      fmt::format("{0} --force {1} --only {1}", guard_->command, for_shell(node.slot));
  Ledger(store_).write({node.slot, node.stage, node.result.code, node.result.sentence, key, program_digest(),
                        inputs, command});
}

std::vector<Node*> Pipeline::chosen(const Wish& wish, std::set<std::string>& asked) {
  for (const auto* patterns : {&wish.only, &wish.until})
    for (const auto& pattern : *patterns)
      for (const auto& slot : matching(pattern)) asked.insert(slot);
  const bool all = wish.only.empty() && wish.until.empty();
  std::vector<Node*> todo;
  std::set<const Node*> needed;
  for (auto it = nodes_.rbegin(); it != nodes_.rend(); ++it) {
    Node* node = it->get();
    if (node->constant || !(all || asked.contains(node->slot) || needed.contains(node))) continue;
    needed.insert(node->inputs.begin(), node->inputs.end());
    todo.push_back(node);
  }
  return {todo.rbegin(), todo.rend()};
}

std::vector<SlotResult> Pipeline::run(const Wish& wish, Watcher& watcher) {
  std::set<std::string> asked, forced;
  for (const auto& pattern : wish.force)
    for (const auto& slot : matching(pattern)) forced.insert(slot);
  const std::vector<Node*> todo = chosen(wish, asked);
  for (Node* node : todo) {
    node->content.reset();
    node->result = SlotResult{};
    node->result.slot = node->slot;
    node->result.stage = node->stage;
  }
  Schedule(todo, watcher, [&](Node& node, Watcher& guarded) {
    settle(node, forced.contains(node.slot), guarded);
  }).run(wish.jobs, wish.memory_gib, wish.cores);

  std::vector<SlotResult> results;
  for (const Node* node : todo)
    if (wish.only.empty() || asked.contains(node->slot) || node->result.state != SlotState::hit)
      results.push_back(node->result);
  return results;
}

Forecast Pipeline::forecast_of(Node& node, bool forced) {
  const auto recipe = recipe_of(node);
  if (!recipe) {
    for (const Node* input : node.inputs)
      if (!input->content)
        return {node.slot, "after", (input->result.known ? "skipped with " : "once there is ") + input->slot};
  }
  if (forced) return {node.slot, "make", "--force"};
  if (node.content) return {node.slot, "hit", ""};
  if (failed_before(node, sha256_of(*recipe)))
    return {node.slot, "failed", "failed before: " + node.result.sentence};
  if (const auto failure = Ledger(store_).find(node.slot); failure && failure->key == sha256_of(*recipe))
    return {node.slot, "make", "failed before"};
  const auto before = store_.slot(node.slot);
  return {node.slot, "make", before ? kind_of_change(before->recipe, *recipe) : "never made"};
}

std::vector<Forecast> Pipeline::forecast(const Wish& wish) {
  std::set<std::string> asked, forced;
  for (const auto& pattern : wish.force)
    for (const auto& slot : matching(pattern)) forced.insert(slot);
  std::vector<Forecast> lines;
  for (Node* node : chosen(wish, asked)) {
    look_up(*node);
    lines.push_back(forecast_of(*node, forced.contains(node->slot)));
  }
  return lines;
}

void Pipeline::look_up(Node& node) {
  if (node.content) return;
  node.result.slot = node.slot;
  node.result.stage = node.stage;
  node.result.sentence = "not made yet";
  const auto recipe = recipe_of(node);
  const auto record = recipe ? store_.find(sha256_of(*recipe)) : std::nullopt;
  if (record) accept(node, *record, SlotState::hit);
}

void Pipeline::recall_failure(Node& node) const {
  const auto failure = Ledger(store_).find(node.slot);
  const auto recipe = failure ? recipe_of(node) : std::nullopt;
  if (recipe && failure->key == sha256_of(*recipe)) recall(*failure, node.result);
}

std::vector<SlotResult> Pipeline::present() {
  std::vector<SlotResult> results;
  for (auto& node : nodes_) {
    if (node->constant) continue;
    look_up(*node);
    if (!node->content) recall_failure(*node);
    results.push_back(node->result);
  }
  return results;
}

std::vector<std::pair<std::string, std::string>> Pipeline::status() {
  std::vector<std::pair<std::string, std::string>> lines;
  for (auto& node : nodes_) {
    if (node->constant) continue;
    look_up(*node);
    lines.emplace_back(node->slot, node->content ? "hit" : recipe_of(*node) ? "miss" : "?");
  }
  return lines;
}

std::string Pipeline::reasons(Node& node, int depth) {
  const auto recipe = recipe_of(node);
  const auto before = store_.slot(node.slot);
  if (!recipe) {
    std::string text = node.slot + ": ? (an input is not made yet)\n";
    for (Node* input : node.inputs)
      if (!input->content) text += reasons(*input, depth + 1);
    return text;
  }
  if (node.content) {
    if (depth > 0) return "";
    const std::string last =
        before && !before->previous_recipe.empty()
            ? "; it was last made anew because\n" + difference(before->previous_recipe, *recipe)
            : "\n";
    return node.slot + ": hit" + last;
  }
  if (!before) return node.slot + ": miss, it was never made\n";
  const std::string changes = difference(before->recipe, *recipe);
  return node.slot + ": miss, " +
         (changes.empty() ? "its artefact is gone\n" : "its recipe changed\n" + changes);
}

std::string Pipeline::why(const std::string& slot) {
  status();
  std::string text;
  for (const auto& name : matching(slot)) text += reasons(node(name), 0);
  return text;
}

std::string Pipeline::graph_dot() const {
  std::string dot = "digraph geocage {\n  rankdir=LR;\n  node [shape=box];\n";
  for (const auto& node : nodes_) {
    if (node->constant) continue;
    dot += "  " + for_dot(node->slot) + ";\n";
    for (const Node* input : node->inputs)
      if (!input->constant) dot += "  " + for_dot(input->slot) + " -> " + for_dot(node->slot) + ";\n";
  }
  return dot + "}\n";
}

}  // namespace geocage::pipeline
