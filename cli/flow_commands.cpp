#include <algorithm>
#include <fstream>
#include <set>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <fnmatch.h>
#include <nlohmann/json.hpp>

#include "cli/commands.h"
#include "cli/console.h"
#include "cli/muted_stdout.h"
#include "cli/run_report.h"

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
          {"report", summary.report.empty() ? json() : json(summary.report.string())}};
}

void print(const RunSummary& summary) {
  for (const auto& pair : summary.pairs)
    if (pair.outcome != PairOutcome::done)
      fmt::print("{} with {}: {}: {}\n", pair.object, pair.hand, word(pair.outcome), pair.sentence);
  const auto made = std::count_if(summary.slots.begin(), summary.slots.end(), [](const SlotResult& slot) {
    return slot.state == pipeline::SlotState::made;
  });
  const reports::Counts& c = summary.counts;
  fmt::print("{} of {} slots made, the others were there\n", made, summary.slots.size());
  fmt::print("in {} = done {} + failed {} + rejected {} + skipped {}\n", c.in, c.done, c.failed, c.rejected,
             c.skipped);
  if (!summary.report.empty()) fmt::print("report: {}\n", summary.report.string());
}

int exit_code(const reports::Counts& counts) {
  return counts.done == counts.in ? 0 : 1;
}

/// A store and the flow's slots over it.
struct Opened {
  Store store;
  Pipeline pipeline;
  Flow flow;
  Opened(const Shared& shared, const FlowRequest& request)
      : store(shared.store), pipeline(store), flow(plan_flow(request, pipeline)) {}
};

}  // namespace

int run(const Shared& shared, const RunOptions& options) {
  Opened opened(shared, options.flow);
  opened.store.sweep_scratch();
  RunSummary summary;
  {
    const MutedStdout muted;
    Console console(shared.quiet);
    summary = summarise(opened.flow, opened.pipeline.run(options.wish, console));
  }
  if (options.wish.only.empty() && options.wish.until.empty())
    summary.report = write_run_report(opened.flow, summary, shared.out);
  if (shared.json)
    fmt::print("{}\n", to_json(summary).dump(2));
  else
    print(summary);
  return exit_code(summary.counts);
}

int status(const Shared& shared, const FlowRequest& request) {
  Opened opened(shared, request);
  json list = json::array();
  for (const auto& [slot, state] : opened.pipeline.status())
    if (shared.json)
      list.push_back({{"slot", slot}, {"state", state}});
    else
      fmt::print("{:<4} {}\n", state, slot);
  if (shared.json) fmt::print("{}\n", json{{"schema", "geocage-status 1"}, {"slots", list}}.dump(2));
  return 0;
}

int why(const Shared& shared, const FlowRequest& request, const std::string& slot) {
  Opened opened(shared, request);
  const std::string reasons = opened.pipeline.why(slot);
  if (shared.json)
    fmt::print("{}\n", json{{"schema", "geocage-why 1"}, {"slot", slot}, {"why", reasons}}.dump(2));
  else
    fmt::print("{}", reasons);
  return 0;
}

int metrics(const Shared& shared, const std::string& pattern) {
  const Store store(shared.store);
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
    fmt::print("\"{}\",{:.3f}", slot, record.seconds);
    for (const auto& name : names) {
      const auto it = record.metrics.find(name);
      fmt::print(",{}", it == record.metrics.end() ? "" : fmt::format("{:.6g}", it->second));
    }
    fmt::print("\n");
  }
  if (shared.json) fmt::print("{}\n", json{{"schema", "geocage-metrics 1"}, {"slots", list}}.dump(2));
  return 0;
}

int show(const Shared& shared, const FlowRequest&, const std::string& slot) {
  const Store store(shared.store);
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
    fmt::print("{}\n", json{{"schema", "geocage-slot 1"},
                            {"slot", slot},
                            {"folder", folder.string()},
                            {"recipe", record->recipe},
                            {"metrics", record->metrics},
                            {"files", files},
                            {"seconds", record->seconds},
                            {"made_at", record->made_at}}
                           .dump(2));
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
    fmt::print("{}\n", json{{"schema", "geocage-graph 1"}, {"dot", dot}}.dump(2));
  else
    fmt::print("{}", dot);
  return 0;
}

int report(const Shared& shared, const FlowRequest& request) {
  Opened opened(shared, request);
  RunSummary summary = summarise(opened.flow, opened.pipeline.present());
  summary.report = write_run_report(opened.flow, summary, shared.out);
  if (shared.json)
    fmt::print("{}\n", to_json(summary).dump(2));
  else
    print(summary);
  return exit_code(summary.counts);
}

int verify(const Shared& shared) {
  const Store store(shared.store);
  const auto faults = store.verify();
  if (shared.json)
    fmt::print("{}\n", json{{"schema", "geocage-verify 1"}, {"faults", faults}}.dump(2));
  else if (faults.empty())
    fmt::print("{}: every artefact has the digest that names it\n", store.root().string());
  else
    for (const auto& fault : faults) fmt::print("{}\n", fault);
  return faults.empty() ? 0 : static_cast<int>(pipeline::Fault::store);
}

int collect_garbage(const Shared& shared, bool dry_run) {
  const auto garbage = Store(shared.store).collect_garbage(dry_run);
  const double megabytes = static_cast<double>(garbage.bytes) / 1e6;
  if (shared.json)
    fmt::print("{}\n", json{{"schema", "geocage-gc 1"},
                            {"dry_run", dry_run},
                            {"entries", garbage.paths.size()},
                            {"bytes", garbage.bytes}}
                           .dump(2));
  else
    fmt::print("{} {} entries, {:.1f} MB\n", dry_run ? "would remove" : "removed", garbage.paths.size(),
               megabytes);
  return 0;
}

}  // namespace geocage::cli
