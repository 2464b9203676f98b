#include <algorithm>
#include <fstream>
#include <map>
#include <optional>
#include <set>
#include <thread>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <fnmatch.h>
#include <nlohmann/json.hpp>
#include <omp.h>

#include "cli/commands.h"
#include "cli/console.h"
#include "cli/muted_stdout.h"
#include "cli/results_table.h"
#include "cli/run_report.h"
#include "pipeline/ledger.h"
#include "pipeline/passing_folder.h"
#include "pipeline/shares.h"
#include "pipeline/spelling.h"

namespace geocage::cli {

namespace fs = std::filesystem;
using nlohmann::json;
using pipeline::Pipeline;
using pipeline::SlotResult;
using pipeline::Store;

namespace {

json to_json(const RunSummary& summary) {
  json slots = json::array();
  for (const auto& slot : summary.slots)
    slots.push_back({{"slot", slot.slot},
                     {"state", pipeline::word(slot.state)},
                     {"seconds", slot.seconds},
                     {"folder", slot.folder.string()},
                     {"code", slot.code},
                     {"sentence", slot.sentence}});
  const reports::Counts& c = summary.counts;
  return {{"schema", "geocage-run 1"},
          {"counts",
           {{"in", c.in},
            {"done", c.done},
            {"failed", c.failed},
            {"rejected", c.rejected},
            {"skipped", c.skipped}}},
          {"slots", slots},
          {"results", summary.results.empty() ? json() : json(summary.results.string())},
          {"report", summary.report.empty() ? json() : json(summary.report.string())}};
}

void print(const RunSummary& summary) {
  for (const auto& pair : summary.pairs)
    if (pair.outcome != PairOutcome::done)
      fmt::print("{} with {}: {}: {}\n", pair.object, pair.hand, word(pair.outcome), pair.sentence);
  const auto number_of = [&](pipeline::SlotState state) {
    return std::ranges::count(summary.slots, state, &SlotResult::state);
  };
  const reports::Counts& c = summary.counts;
  fmt::print("{} slots: {} made, {} there before, {} failed, {} skipped\n", summary.slots.size(),
             number_of(pipeline::SlotState::made), number_of(pipeline::SlotState::hit),
             number_of(pipeline::SlotState::failed), number_of(pipeline::SlotState::skipped));
  fmt::print("in {} = done {} + failed {} + rejected {} + skipped {}\n", c.in, c.done, c.failed, c.rejected,
             c.skipped);
  const auto known = std::ranges::count_if(summary.slots, [](const SlotResult& slot) { return slot.known; });
  if (known > 0)
    fmt::print(
        "{} slots failed before and were not tried again (--retry failed does); see geocage failures\n",
        known);
  if (!summary.results.empty()) fmt::print("results: {}\n", summary.results.string());
  if (!summary.report.empty()) fmt::print("report: {}\n", summary.report.string());
}

int exit_code(const reports::Counts& counts) {
  return counts.done == counts.in ? 0 : 1;
}

/// The command that plans the same flow, for the ledger: from the same folder, which the flow's paths start
/// from, too.
std::string command_of(const Shared& shared, const RunOptions& options) {
  const FlowRequest& request = options.flow;
  std::error_code gone;
  std::string command = "cd " + pipeline::for_shell(fs::current_path(gone).string()) + " && geocage run";
  if (request.file) command += " " + pipeline::for_shell(request.file->string());
  const auto option = [&](const char* name, const std::string& value) {
    if (!value.empty()) command += std::string(" ") + name + " " + pipeline::for_shell(value);
  };
  option("--dataset", request.dataset);
  option("--object", request.object);
  option("--hand", request.hand);
  for (const auto& set : request.sets) option("--set", set);
  option("--store", shared.store.string());
  const RunOptions usual;
  if (options.stage_seconds != usual.stage_seconds)
    option("--stage-seconds", fmt::format("{}", options.stage_seconds));
  if (options.stage_memory_gib != usual.stage_memory_gib)
    option("--stage-memory-gib", fmt::format("{}", options.stage_memory_gib));
  return command;
}

/// The store, for commands that have nothing to say without one; they make none.
Store standing_store(const Shared& shared) {
  if (!Store::stands_at(shared.store))
    throw pipeline::UserError(pipeline::Fault::store, shared.store.string(), "there is no store here",
                              "--store names another folder; geocage run makes a store");
  return Store(shared.store);
}

/// For commands that look at a flow, which may be done before there is a store: an empty one in its place,
/// that goes with the command. Scenes are made in it, since they are needed to know a flow's slots.
class PassingStore {
 public:
  explicit PassingStore(const Shared& shared) {
    if (Store::stands_at(shared.store)) return;
    if (!shared.quiet)
      tell(fmt::format("{}: there is no store here yet, and none is made\n", shared.store.string()));
    folder_.emplace();
  }
  fs::path root_or(const fs::path& standing) const { return folder_ ? folder_->path() / "store" : standing; }

 private:
  std::optional<pipeline::PassingFolder> folder_;
};

enum class Purpose { making, looking };

/// A store and the flow's slots over it.
struct Opened {
  std::optional<PassingStore> passing;
  Store store;
  Pipeline pipeline;
  Flow flow;
  Opened(const Shared& shared, const RunOptions& options, Purpose purpose)
      : passing(purpose == Purpose::looking ? std::optional<PassingStore>(std::in_place, shared)
                                            : std::nullopt),
        store(passing ? passing->root_or(shared.store) : root_for(options.flow, shared.store)),
        pipeline(store),
        flow(plan(shared, options)) {}
  Opened(const Shared& shared, const FlowRequest& request)
      : Opened(shared, RunOptions{.flow = request}, Purpose::looking) {}

 private:
  /// A flow with mistakes in it makes no store.
  static const fs::path& root_for(const FlowRequest& request, const fs::path& root) {
    if (!Store::stands_at(root)) check_flow(request);
    return root;
  }

  Flow plan(const Shared& shared, const RunOptions& options) {
    pipeline.guard({.limits = {.seconds = options.stage_seconds,
                               .memory_gib = options.stage_memory_gib,
                               .threads = static_cast<int>(std::max(1u, std::thread::hardware_concurrency())),
                               .subject = "the stage",
                               .hint = "--stage-seconds and --stage-memory-gib set the limits"},
                    .retry_failed = options.retry_failed,
                    .prepare =
                        [](const std::atomic<int>& share) {
                          pipeline::follow(share);
                          omp_set_num_threads(share);  // of loops that don't change their threads midway
                        },
                    .command = command_of(shared, options)});
    return plan_flow(options.flow, pipeline);
  }
};

int dry_run(const Shared& shared, Opened& opened, const pipeline::Wish& wish) {
  const auto lines = opened.pipeline.forecast(wish);
  std::map<std::string, int> counts;
  json list = json::array();
  for (const auto& line : lines) {
    ++counts[line.state];
    if (shared.json)
      list.push_back({{"slot", line.slot}, {"state", line.state}, {"reason", line.reason}});
    else if (line.state != "hit")
      fmt::print("{:<6} {}: {}\n", line.state, line.slot, line.reason);
  }
  if (shared.json)
    print_json(json{{"schema", "geocage-forecast 1"}, {"slots", list}});
  else
    fmt::print("{} slots: {} to make, {} after them, {} there, {} failed before\n", lines.size(),
               counts["make"], counts["after"], counts["hit"], counts["failed"]);
  return 0;
}

}  // namespace

int run(const Shared& shared, const RunOptions& options) {
  Opened opened(shared, options, options.dry_run ? Purpose::looking : Purpose::making);
  if (options.dry_run) return dry_run(shared, opened, options.wish);
  prepare_report(shared.out, options.single_file);
  opened.store.sweep_scratch();
  pipeline::sweep_passing_folders(fs::temp_directory_path());
  RunSummary summary;
  {
    const MutedStdout muted;
    Console console(shared.quiet);
    console.planned(opened.flow.pairs.size(), opened.pipeline.slots().size(), options.wish.jobs);
    summary = summarise(opened.flow, opened.pipeline.run(options.wish, console));
  }
  const auto alone = alone_in(shared.out);
  // The table first: it is there however long the pictures take.
  if (options.wish.only.empty()) summary.results = write_results(opened.flow, summary, shared.out);
  if (options.wish.only.empty() && options.wish.until.empty())
    summary.report =
        write_run_report(opened.flow, summary, shared.out,
                         {pipeline::Ledger(opened.store).all(), options.single_file, options.pictures});
  if (shared.json)
    print_json(to_json(summary));
  else
    print(summary);
  return exit_code(summary.counts);
}

int query(const Shared& shared, const QueryOptions& options) {
  const Table table = select_from(options.database.empty() ? shared.out / "results.sqlite" : options.database,
                                  options.statement);
  if (options.csv) {
    fmt::print("{}", csv_text(table));
    return 0;
  }
  if (shared.json) {
    json rows = json::array();
    for (const auto& row : table.rows) {
      json& cells = rows.emplace_back(json::array());
      for (const auto& cell : row)
        if (const auto* number = std::get_if<double>(&cell))
          cells.push_back(*number);
        else if (const auto* text = std::get_if<std::string>(&cell))
          cells.push_back(*text);
        else
          cells.push_back(nullptr);
    }
    print_json(json{{"schema", "geocage-query 1"}, {"columns", table.columns}, {"rows", rows}});
    return 0;
  }
  std::vector<std::size_t> widths;
  for (std::size_t i = 0; i < table.columns.size(); ++i) {
    std::size_t width = table.columns[i].size();
    for (const auto& row : table.rows) width = std::max(width, cell_text(row[i]).size());
    widths.push_back(width);
  }
  const auto line = [&](const auto& text_of) {
    std::string text;
    for (std::size_t i = 0; i < widths.size(); ++i) text += fmt::format("{:<{}}  ", text_of(i), widths[i]);
    fmt::print("{}\n", text.substr(0, text.find_last_not_of(' ') + 1));
  };
  line([&](std::size_t i) { return table.columns[i]; });
  for (const auto& row : table.rows) line([&](std::size_t i) { return cell_text(row[i]); });
  return 0;
}

int failures(const Shared& shared) {
  const Store store = standing_store(shared);
  json list = json::array();
  for (const auto& failure : pipeline::Ledger(store).all()) {
    if (shared.json)
      list.push_back({{"slot", failure.slot},
                      {"stage", failure.stage},
                      {"code", failure.code},
                      {"sentence", failure.sentence},
                      {"recipe", failure.key},
                      {"inputs", failure.inputs},
                      {"command", failure.command}});
    else
      fmt::print("{} [{}] {}\n  inputs {}\n  {}\n", failure.slot, failure.code, failure.sentence,
                 failure.inputs, failure.command);
  }
  if (shared.json) print_json(json{{"schema", "geocage-failures 1"}, {"failures", list}});
  return 0;
}

int status(const Shared& shared, const FlowRequest& request) {
  Opened opened(shared, request);
  json list = json::array();
  for (const auto& [slot, state] : opened.pipeline.status())
    if (shared.json)
      list.push_back({{"slot", slot}, {"state", state}});
    else
      fmt::print("{:<4} {}\n", state, slot);
  if (shared.json) print_json(json{{"schema", "geocage-status 1"}, {"slots", list}});
  return 0;
}

int why(const Shared& shared, const FlowRequest& request, const std::string& slot) {
  Opened opened(shared, request);
  const std::string reasons = opened.pipeline.why(slot);
  if (shared.json)
    print_json(json{{"schema", "geocage-why 1"}, {"slot", slot}, {"why", reasons}});
  else
    fmt::print("{}", reasons);
  return 0;
}

int metrics(const Shared& shared, const std::string& pattern) {
  const Store store = standing_store(shared);
  std::vector<std::pair<std::string, pipeline::Record>> found;
  std::set<std::string> names;
  for (const auto& slot : store.slots()) {
    if (fnmatch(pattern.c_str(), slot.c_str(), 0) != 0) continue;
    const auto note = store.slot(slot);
    const auto record = note ? store.find(note->key) : std::nullopt;
    if (!record) continue;
    for (const auto& [name, value] : record->metrics) names.insert(name);
    found.emplace_back(slot, *record);
  }
  if (found.empty())
    throw pipeline::UserError(pipeline::Fault::configuration, pattern, "the store holds no such slot",
                              "quote the pattern: '*/remesh'");
  json list = json::array();
  if (!shared.json) fmt::print("slot,seconds,{}\n", fmt::join(names, ","));
  for (const auto& [slot, record] : found) {
    list.push_back({{"slot", slot}, {"seconds", record.seconds}, {"metrics", record.metrics}});
    if (shared.json) continue;
    fmt::print("{},{:.3f}", pipeline::for_csv(slot), record.seconds);
    for (const auto& name : names) {
      const auto it = record.metrics.find(name);
      fmt::print(",{}", it == record.metrics.end() ? "" : fmt::format("{:.6g}", it->second));
    }
    fmt::print("\n");
  }
  if (shared.json) print_json(json{{"schema", "geocage-metrics 1"}, {"slots", list}});
  return 0;
}

int show(const Shared& shared, const FlowRequest&, const std::string& slot) {
  const Store store = standing_store(shared);
  const auto note = store.slot(slot);
  const auto record = note ? store.find(note->key) : std::nullopt;
  if (!record)
    throw pipeline::UserError(pipeline::Fault::configuration, slot,
                              "the store holds no such slot" + pipeline::did_you_mean(slot, store.slots()),
                              "geocage status lists the slots of a flow");
  const fs::path folder = store.folder(record->content);
  json files = json::object();
  for (const auto& entry : fs::directory_iterator(folder)) files[entry.path().filename()] = entry.file_size();
  if (shared.json) {
    print_json(json{{"schema", "geocage-slot 1"},
                    {"slot", slot},
                    {"folder", folder.string()},
                    {"recipe", record->recipe},
                    {"metrics", record->metrics},
                    {"files", files},
                    {"seconds", record->seconds},
                    {"made_at", record->made_at}});
    return 0;
  }
  fmt::print("{}\n{}\nmade in {:.2f} s at {}\n\n{}\n", slot, folder.string(), record->seconds,
             record->made_at, record->recipe);
  for (const auto& [name, value] : record->metrics) fmt::print("metric {} = {}\n", name, value);
  for (const auto& [name, size] : files.items()) fmt::print("file {} {} bytes\n", name, size.dump());
  return 0;
}

int graph(const Shared& shared, const FlowRequest& request) {
  const std::string dot = Opened(shared, request).pipeline.graph_dot();
  if (shared.json)
    print_json(json{{"schema", "geocage-graph 1"}, {"dot", dot}});
  else
    fmt::print("{}", dot);
  return 0;
}

int report(const Shared& shared, const FlowRequest& request, bool single_file, int pictures) {
  standing_store(shared);
  Opened opened(shared, request);
  prepare_report(shared.out, single_file);
  RunSummary summary = summarise(opened.flow, opened.pipeline.present());
  const auto alone = alone_in(shared.out);
  summary.report = write_run_report(opened.flow, summary, shared.out,
                                    {pipeline::Ledger(opened.store).all(), single_file, pictures});
  if (shared.json)
    print_json(to_json(summary));
  else
    print(summary);
  return exit_code(summary.counts);
}

int verify(const Shared& shared) {
  const Store store = standing_store(shared);
  const auto [artefacts, faults] = store.verify();
  if (shared.json)
    print_json(json{{"schema", "geocage-verify 1"}, {"artefacts", artefacts}, {"faults", faults}});
  else if (faults.empty())
    fmt::print("{}: {} artefacts, each has the digest that names it\n", store.root().string(), artefacts);
  else
    for (const auto& fault : faults) fmt::print("{}\n", fault);
  return faults.empty() ? 0 : static_cast<int>(pipeline::Fault::store);
}

int collect_garbage(const Shared& shared, bool dry_run) {
  const auto garbage = standing_store(shared).collect_garbage(dry_run);
  const double megabytes = static_cast<double>(garbage.bytes) / 1e6;
  if (shared.json)
    print_json(json{{"schema", "geocage-gc 1"},
                    {"dry_run", dry_run},
                    {"entries", garbage.paths.size()},
                    {"bytes", garbage.bytes}});
  else
    fmt::print("{} {} entries, {:.1f} MB\n", dry_run ? "would remove" : "removed", garbage.paths.size(),
               megabytes);
  return 0;
}

}  // namespace geocage::cli
