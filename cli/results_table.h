#pragma once
#include <vector>

#include "cli/run_report.h"
#include "cli/table.h"

namespace geocage::cli {

/// One row a grasp. A pair that was lost on the way, or has no grasp, has one row with held = 0, so that no
/// rate forgets it (docs/results.md).
Table grasp_table(const Flow& flow, const RunSummary& summary);

/// Of every hand and combination of levels but seeds: the share of rows that were held, and of pairs whose
/// best grasp was, each with Wilson's interval and one of a bootstrap over objects.
Table rate_table(const Flow& flow, const Table& grasps);

/// Of every list of the sweep but seeds: each level against the first, on the same object, hand, seed and
/// other levels: the mean difference of "best grasp held".
Table paired_table(const Flow& flow, const Table& grasps);

/// Of every hand and combination of levels but seeds: how many pairs lost their best grasp at which stage.
Table loss_table(const Flow& flow, const Table& grasps);

/// Of every hand and combination of levels but seeds: means of how scores agree with the reference's, and
/// their bootstrap over objects. No rows where the flow compares nothing.
Table agreement_table(const Flow& flow, const Table& grasps);

/// Every slot of the run: state, failure, seconds and peak memory when it was made.
Table slot_table(const RunSummary& summary);

/// results.csv, results.json (all tables but grasps and slots), and results.sqlite with all of them; answers
/// the CSV.
std::filesystem::path write_results(const Flow& flow, const RunSummary& summary,
                                    const std::filesystem::path& folder);

}  // namespace geocage::cli
