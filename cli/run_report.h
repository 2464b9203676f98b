#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "cli/flow.h"
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

/// Writes the report into `folder` unless the one there shows the same; answers its index.html. At most
/// `pictures` pairs are drawn, the first ones.
std::filesystem::path write_run_report(const Flow& flow, const RunSummary& summary,
                                       const std::filesystem::path& folder, int pictures);

}  // namespace geocage::cli
