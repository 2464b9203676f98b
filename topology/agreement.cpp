#include "topology/agreement.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>
#include <queue>

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

std::vector<int> largest(const std::vector<double>& values) {
  double most = -std::numeric_limits<double>::infinity();
  for (double x : values)
    if (x > most) most = x;  // NaN never is
  std::vector<int> all;
  for (int v = 0; v < static_cast<int>(values.size()); ++v)
    if (values[v] == most) all.push_back(v);
  return all;
}

std::vector<double> ways_from(const std::vector<int>& sources, const geometry::TriangleMesh& mesh) {
  const auto neighbours = geometry::vertex_neighbours(mesh);
  std::vector<double> best(mesh.vertices.size(), std::numeric_limits<double>::infinity());
  std::priority_queue<std::pair<double, int>, std::vector<std::pair<double, int>>, std::greater<>> queue;
  for (int v : sources) queue.emplace(best[v] = 0, v);
  while (!queue.empty()) {
    const auto [d, v] = queue.top();
    queue.pop();
    if (d > best[v]) continue;
    for (int i = neighbours.start[v]; i < neighbours.start[v + 1]; ++i) {
      const int w = neighbours.items[i];
      const double next = d + (mesh.vertices[v] - mesh.vertices[w]).norm();
      if (next < best[w]) queue.emplace(best[w] = next, w);
    }
  }
  return best;
}

}  // namespace geocage::topology
