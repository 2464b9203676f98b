#include "topology/agreement.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace geocage::topology {

namespace {

/// Ranks 0 .. n - 1, equal values with the mean of theirs.
std::vector<double> mean_ranks(const std::vector<double>& values) {
  std::vector<int> order(values.size());
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](int a, int b) { return values[a] < values[b]; });
  std::vector<double> ranks(values.size());
  for (std::size_t from = 0, to = 0; from < order.size(); from = to) {
    while (to < order.size() && values[order[to]] == values[order[from]]) ++to;
    for (std::size_t i = from; i < to; ++i) ranks[order[i]] = static_cast<double>(from + to - 1) / 2;
  }
  return ranks;
}

double correlation(const std::vector<double>& x, const std::vector<double>& y) {
  const double mean = static_cast<double>(x.size() - 1) / 2;  // of ranks
  double xx = 0, yy = 0, xy = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    xx += (x[i] - mean) * (x[i] - mean);
    yy += (y[i] - mean) * (y[i] - mean);
    xy += (x[i] - mean) * (y[i] - mean);
  }
  return xx > 0 && yy > 0 ? xy / std::sqrt(xx * yy) : std::nan("");
}

}  // namespace

double rank_correlation(const std::vector<double>& first, const std::vector<double>& second) {
  std::vector<double> x, y;
  for (std::size_t i = 0; i < first.size(); ++i)
    if (std::isfinite(first[i]) && std::isfinite(second[i])) {
      x.push_back(first[i]);
      y.push_back(second[i]);
    }
  if (x.size() < 2) return std::nan("");
  return correlation(mean_ranks(x), mean_ranks(y));
}

std::vector<int> top_set(const std::vector<double>& values, double share) {
  std::vector<double> finite;
  for (double x : values)
    if (std::isfinite(x)) finite.push_back(x);
  std::vector<int> set;
  const auto wanted = static_cast<std::ptrdiff_t>(std::ceil(share * static_cast<double>(finite.size())));
  if (wanted == 0) return set;
  std::nth_element(finite.begin(), finite.begin() + wanted - 1, finite.end(), std::greater<>());
  const double least = finite[wanted - 1];
  for (int i = 0; i < static_cast<int>(values.size()); ++i)
    if (values[i] >= least) set.push_back(i);
  return set;
}

double overlap(const std::vector<int>& first, const std::vector<int>& second) {
  std::vector<int> common;
  std::set_intersection(first.begin(), first.end(), second.begin(), second.end(), std::back_inserter(common));
  const auto all = first.size() + second.size() - common.size();
  return all == 0 ? 1 : static_cast<double>(common.size()) / static_cast<double>(all);
}

}  // namespace geocage::topology
