#pragma once
#include <cstdint>
#include <limits>
#include <vector>

namespace geocage::reports {

/// Mean of all values, and where 95 % of the means of resampled groups lie.
struct BootstrapMean {
  double mean = 0;
  double low = std::numeric_limits<double>::quiet_NaN(), high = low;
};

/// Percentile bootstrap (Efron 1979) of a mean over groups: grasps of one object are alike, so whole objects
/// are drawn, with replacement, as many as there are. The same answer for the same groups and seed on every
/// machine. No values: a mean of zero. Fewer than two groups with values: no interval, `low` and `high` are
/// NaN. O(draws * groups).
BootstrapMean bootstrap_over_groups(const std::vector<std::vector<double>>& groups, int draws = 2000,
                                    std::uint64_t seed = 1);

}  // namespace geocage::reports
