#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "cli/flow.h"
#include "pipeline/ledger.h"
#include "reports/report.h"

namespace geocage::cli {

/// What became of an object-hand pair. `rejected`: no grasp was left to test; grasps that are all lost are
/// `done`.
enum class PairOutcome { done, failed, rejected, skipped };
std::string_view word(PairOutcome outcome);

struct PairResult {
  std::string object, hand, sentence;
  PairOutcome outcome = PairOutcome::done;
};

struct RunSummary {
  std::vector<pipeline::SlotResult> slots;
  std::vector<PairResult> pairs;
  reports::Counts counts;         ///< of pairs, of all variants
  std::filesystem::path report;   ///< index.html; empty when none was written
  std::filesystem::path results;  ///< results.csv; empty when none was written
};

RunSummary summarise(const Flow& flow, std::vector<pipeline::SlotResult> slots);

/// What a report shows beside the flow's artefacts, and how.
struct ReportOptions {
  std::vector<pipeline::Failure> failures;
  bool single_file = false;
  int pictures = 200;  ///< so many pairs are drawn at most, the first ones
};

/// Finds out, before anything is made, whether a report can be written at all: makes its folder. UserError
/// (configuration) for a single file when the pages' scripts were not built.
void prepare_report(const std::filesystem::path& folder, bool single_file);

/// Those who write into one folder do so one after the other, while each holds this.
pipeline::FileLock alone_in(const std::filesystem::path& folder);

/// The report in `folder` is written anew next time; whoever changes the folder says so first.
void forget_report(const std::filesystem::path& folder);

/// Writes the report into `folder` unless the one there shows the same; answers its index.html, or
/// report.html for a single file.
std::filesystem::path write_run_report(const Flow& flow, const RunSummary& summary,
                                       const std::filesystem::path& folder, const ReportOptions& options);

/// The folder of the pages' scripts: that in the environment variable GEOCAGE_VIEWER, else the one of the
/// build.
std::filesystem::path viewer_folder();

}  // namespace geocage::cli
