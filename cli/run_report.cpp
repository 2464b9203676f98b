#include "cli/run_report.h"

#include <cerrno>
#include <cstdlib>
#include <fstream>
#include <map>
#include <sstream>
#include <system_error>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <unistd.h>

#include "cli/results_table.h"
#include "pipeline/digest.h"
#include "pipeline/text_file.h"
#include "pipeline/who_and_when.h"
#include "reports/viewer_files.h"

namespace geocage::cli {

namespace fs = std::filesystem;
using pipeline::SlotResult;
using pipeline::SlotState;

std::string_view word(PairOutcome outcome) {
  constexpr std::string_view words[] = {"done", "failed", "rejected", "skipped"};
  return words[static_cast<int>(outcome)];
}

namespace {

using Slots = std::map<std::string, const SlotResult*>;

PairResult result_of(const FlowPair& pair, const Slots& slots) {
  PairResult result{pair.object, pair.hand, "", PairOutcome::done};
  const auto end = [&](PairOutcome outcome, std::string sentence) {
    result.outcome = outcome;
    result.sentence = std::move(sentence);
    return result;
  };
  if (!pair.skipped.empty()) return end(PairOutcome::skipped, pair.skipped);
  if (!pair.failed.empty()) return end(PairOutcome::failed, pair.failed);
  for (const auto& name : pair.slots) {
    const auto it = slots.find(name);
    if (it == slots.end()) continue;  // not asked for
    const SlotResult& slot = *it->second;
    if (slot.state == SlotState::failed) return end(PairOutcome::failed, slot.sentence);
    if (slot.state == SlotState::skipped) return end(PairOutcome::skipped, slot.slot + ": " + slot.sentence);
    const auto grasps = slot.metrics.find("grasps");
    if (name == pair.place_slot && grasps != slot.metrics.end() && grasps->second == 0)
      return end(PairOutcome::rejected, "no pose of the hand passed all rules of place");
  }
  return result;
}

fs::path folder_of(const Slots& slots, const std::string& name) {
  const auto it = slots.find(name);
  return it == slots.end() ? fs::path() : it->second->folder;
}

/// Scenes in the order of their slots, with the surfaces of the objects that they gave.
std::vector<reports::SceneInput> scenes_of(const RunSummary& summary, const Slots& slots) {
  constexpr std::string_view ending = "/scene";
  std::vector<reports::SceneInput> scenes;
  for (const auto& slot : summary.slots) {
    if (!slot.slot.ends_with(ending) || slot.folder.empty()) continue;
    reports::SceneInput& scene = scenes.emplace_back();
    scene.name = slot.slot.substr(0, slot.slot.size() - ending.size());
    scene.scene = slot.folder;
    std::ifstream file(slot.folder / "scene.json");
    const auto json = nlohmann::json::parse(file);
    for (const auto& object : json.at("objects")) {
      const auto name = object.at("name").get<std::string>();
      scene.meshes.push_back(folder_of(slots, scene.name + (name.empty() ? "" : ".") + name + "/remesh"));
    }
  }
  return scenes;
}

reports::ReportInput input_of(const Flow& flow, const RunSummary& summary, const ReportOptions& options) {
  Slots slots;
  for (const auto& slot : summary.slots) slots[slot.slot] = &slot;
  reports::ReportInput input;
  input.title = flow.name;
  input.flow_text = flow.text;
  input.counts = summary.counts;
  input.hands = flow.hands;
  input.parameters = flow.parameters;
  for (std::size_t i = 0; i < flow.pairs.size(); ++i) {
    const FlowPair& pair = flow.pairs[i];
    const PairResult& result = summary.pairs[i];
    reports::PairInput& shown = input.pairs.emplace_back();
    shown.object = pair.object;
    shown.hand = pair.hand;
    shown.outcome = word(result.outcome);
    shown.sentence = result.sentence;
    shown.source = pair.source;
    shown.truth_known = pair.truth_known;
    shown.drawn = static_cast<int>(i) < options.pictures;
    shown.up_O = pair.up_O;
    shown.cloud = folder_of(slots, pair.object + "/cloud");
    shown.scores = folder_of(slots, pair.score_slot);
    shown.grasps = folder_of(slots, pair.place_slot);
    shown.trajectories = folder_of(slots, pair.approach_slot);
    shown.evaluations = folder_of(slots, pair.evaluate_slot);
    shown.cages = folder_of(slots, pair.cage_slot);
    shown.occupancy = folder_of(slots, pair.object + "/occupancy");
    shown.field = folder_of(slots, pair.object + "/field");
    shown.metric = pair.metric;
    shown.base = pair.base;
    shown.levels = pair.levels;
  }
  for (const auto& failure : options.failures)
    if (slots.contains(failure.slot))
      input.failures.push_back({failure.slot, failure.code, failure.sentence, failure.command});
  const Table grasps = grasp_table(flow, summary);
  for (const Table& table : {grasps, rate_table(flow, grasps), paired_table(flow, grasps),
                             loss_table(flow, grasps), agreement_table(flow, grasps)})
    input.tables.push_back({table.name, table.columns, table.rows});
  input.viewer = viewer_folder();
  input.scenes = scenes_of(summary, slots);
  for (const auto& slot : summary.slots)
    input.slots.push_back({slot.slot, slot.stage, std::string(pipeline::word(slot.state)), slot.seconds,
                           slot.made_seconds, slot.folder, slot.sentence, slot.metrics});
  input.run = {
      {"geocage", GEOCAGE_VERSION}, {"host", pipeline::host_name()}, {"written", pipeline::now_utc()}};
  return input;
}

/// The digest of all that a report shows but the moment it was written: when it is the same, so is the
/// report.
std::string stamp_of(const reports::ReportInput& input) {
  std::ostringstream text;
  text << "geocage-report 5 " << GEOCAGE_VERSION << "\n" << input.title << "\n" << input.flow_text << "\n";
  for (const auto& pair : input.pairs)
    text << pair.object << " " << pair.hand << " " << pair.outcome << " " << pair.drawn << " "
         << pair.sentence << "\n";
  for (const auto& slot : input.slots)
    text << slot.slot << " " << slot.folder.filename().string() << " " << slot.made_seconds << " "
         << slot.sentence << "\n";
  for (const auto& [slot, parameters] : input.parameters)
    for (const auto& [name, value, from] : parameters)
      text << slot << " " << name << " = " << value << " (" << from << ")\n";
  for (const auto& failure : input.failures) text << failure.slot << " " << failure.command << "\n";
  for (const char* part : {"app.js", "scene.js", "plots.js", "app.css"})
    if (reports::viewer_is_built(input.viewer))
      text << part << " " << pipeline::sha256_of_file(input.viewer / part) << "\n";
  return pipeline::sha256_of(text.str());
}

fs::path stamp_file(const fs::path& folder) {
  return folder / "report.key";
}

}  // namespace

RunSummary summarise(const Flow& flow, std::vector<SlotResult> results) {
  RunSummary summary;
  summary.slots = std::move(results);
  Slots slots;
  for (const auto& slot : summary.slots) slots[slot.slot] = &slot;
  auto& counts = summary.counts;
  for (const auto& pair : flow.pairs) {
    summary.pairs.push_back(result_of(pair, slots));
    int* const tallies[] = {&counts.done, &counts.failed, &counts.rejected, &counts.skipped};
    ++*tallies[static_cast<int>(summary.pairs.back().outcome)];
    ++counts.in;
  }
  return summary;
}

fs::path viewer_folder() {
  const char* folder = std::getenv("GEOCAGE_VIEWER");
  return folder ? folder : GEOCAGE_VIEWER_DIR;
}

void prepare_report(const fs::path& folder, bool single_file) {
  if (single_file && !reports::viewer_is_built(viewer_folder()))
    throw pipeline::UserError(pipeline::Fault::configuration, "--single-file",
                              "the report's pages were not built",
                              "install node and npm and build again, or leave --single-file out");
  fs::create_directories(folder);
  if (!fs::is_directory(folder)) throw std::system_error(ENOTDIR, std::generic_category(), folder.string());
}

pipeline::FileLock alone_in(const fs::path& folder) {
  fs::create_directories(folder);
  return pipeline::FileLock(folder / ".lock");
}

void forget_report(const fs::path& folder) {
  fs::remove(stamp_file(folder));
}

fs::path write_run_report(const Flow& flow, const RunSummary& summary, const fs::path& folder,
                          const ReportOptions& options) {
  const auto input = input_of(flow, summary, options);
  const std::string stamp = stamp_of(input);
  const fs::path page = folder / "index.html";
  std::string known;
  std::getline(std::ifstream(stamp_file(folder)), known);
  if (known != stamp || !fs::exists(page)) {
    forget_report(folder);  // one that is broken off is neither the old one nor the new one
    reports::write_report(input, folder);
    pipeline::write_text(stamp_file(folder), stamp + "\n");
  }
  return options.single_file ? reports::write_single_file(folder) : page;
}

}  // namespace geocage::cli
