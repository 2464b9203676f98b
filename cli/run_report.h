#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "cli/flow.h"

namespace geocage::cli {

/// What became of an object-hand pair. `rejected`: no grasp was left to test; grasps that are all lost are `done`.
enum class PairOutcome { done, failed, rejected, skipped };
std::string_view word(PairOutcome outcome);

struct PairResult {
  std::string object, hand, sentence;
  PairOutcome outcome = PairOutcome::done;
};

/// Pairs, of all variants: in = done + failed + rejected + skipped.
struct Counts {
  int in = 0, done = 0, failed = 0, rejected = 0, skipped = 0;
};

struct RunSummary {
  std::vector<pipeline::SlotResult> slots;
  std::vector<PairResult> pairs;
  Counts counts;
  std::filesystem::path report;  ///< index.html; empty when none was written
};

RunSummary summarise(const Flow& flow, std::vector<pipeline::SlotResult> slots);

/// Writes the report into `folder` unless the one there shows the same; answers its index.html.
std::filesystem::path write_run_report(const Flow& flow, const RunSummary& summary, const std::filesystem::path& folder);

}  // namespace geocage::cli
