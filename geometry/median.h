#pragma once
#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

namespace geocage::geometry {

/// The middle value, of an even number the upper one; 0 of none. O(n).
inline double median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// The standard deviation of normal numbers whose sizes these are; a few outliers don't count.
inline double deviation_of_sizes(std::vector<double> sizes) {
  return 1.4826 * median(std::move(sizes));
}

}  // namespace geocage::geometry
