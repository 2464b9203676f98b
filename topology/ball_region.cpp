#include "topology/ball_region.h"

#include <algorithm>
#include <cmath>
#include <queue>

namespace geocage::topology {

Patches make_patches(const BallMesh& mesh) {
  constexpr int farthest_seen = 6 * lanes;  // where no vertex is left nearby, a smaller patch it is
  Patches patches;
  patches.start.push_back(0);
  std::vector<char> assigned(static_cast<std::size_t>(mesh.count));
  std::vector<int> seen(static_cast<std::size_t>(mesh.count) + 1, -1), queue;
  for (int seed = 0; seed < mesh.count; ++seed) {
    if (assigned[seed]) continue;
    queue.assign(1, seed);
    seen[seed] = seed;
    const std::size_t full = patches.sources.size() + lanes;
    for (std::size_t head = 0; head < queue.size() && patches.sources.size() < full && head < farthest_seen; ++head) {
      const int v = queue[head];
      if (!assigned[v]) {
        assigned[v] = 1;
        patches.sources.push_back(v);
      }
      for (int i = mesh.link_start[v]; i < mesh.link_start[v + 1]; ++i) {
        const int w = mesh.links[i].neighbour;
        if (w == mesh.count || seen[w] == seed) continue;
        seen[w] = seed;
        queue.push_back(w);
      }
    }
    patches.start.push_back(static_cast<int>(patches.sources.size()));
  }
  return patches;
}

void Region::clear() {
  for (int v : order_) slot_[v] = 0;
  order_.clear();
  ring_start_.assign(1, 0);
}

void Region::grow_by_hops(const int* sources, int count, int hops) {
  clear();
  patch_ = count;
  for (int i = 0; i < count; ++i) take(sources[i]);
  int head = 0;
  for (int depth = 0; head < size(); ++depth) {
    const int end = size();
    ring_start_.push_back(end);
    if (depth == hops) break;
    for (; head < end; ++head) {
      const int v = order_[head];
      for (int i = mesh_.link_start[v]; i < mesh_.link_start[v + 1]; ++i) {
        const int w = mesh_.links[i].neighbour;
        if (slot_[w] == 0 && w != mesh_.count) take(w);
      }
    }
  }
  link_region(0);
}

void Region::grow_by_length(const int* sources, int count, double radius_m, double quantum_m) {
  clear();
  patch_ = count;
  using Entry = std::pair<double, int>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
  const auto reach_from = [&](double d, int v) {
    for (int i = mesh_.link_start[v]; i < mesh_.link_start[v + 1]; ++i) {
      const int w = mesh_.links[i].neighbour;
      if (w == mesh_.count || slot_[w] != 0) continue;
      const double next = d + (mesh_.position(v) - mesh_.position(w)).norm();
      if (next <= radius_m) queue.emplace(next, w);
    }
  };
  for (int i = 0; i < count; ++i) take(sources[i]);
  ring_start_.push_back(size());
  for (int i = 0; i < count; ++i) reach_from(0, sources[i]);
  double ring_end = mesh_.mean_edge_m;
  while (!queue.empty()) {
    const auto [d, v] = queue.top();
    queue.pop();
    if (slot_[v] != 0) continue;
    if (d > ring_end && size() > ring_start_.back()) {
      ring_start_.push_back(size());
      ring_end = d + mesh_.mean_edge_m;
    }
    take(v);
    reach_from(d, v);
  }
  if (size() > ring_start_.back()) ring_start_.push_back(size());
  link_region(quantum_m);
}

/// Splits the neighbours of each vertex by the order, and adds up what ends at it.
void Region::link_region(double quantum_m) {
  const std::size_t n = order_.size();
  start_.resize(n + 1);
  middle_.resize(n);
  outer_.resize(n);
  own_.resize(n);
  near_.clear();
  start_[0] = 0;
  int ring = 0;
  for (int i = 0; i < size(); ++i) {
    while (i >= ring_start_[ring + 1]) ++ring;
    const int v = order_[i], ring_end = ring_start_[ring + 1];
    const int first = mesh_.link_start[v], last = mesh_.link_start[v + 1];
    const std::size_t begin = near_.size();
    near_.resize(begin + 3 * static_cast<std::size_t>(last - first));
    int* const lower = near_.data() + begin;
    int* const same = lower + (last - first);
    int* const later = same + (last - first);
    int lowers = 0, sames = 0, laters = 0, triangles = 0;
    double area = 0;
    bool was_lower = false, first_lower = false;
    double area_before = 0;
    for (int k = first; k < last; ++k) {
      const int j = slot_[mesh_.links[k].neighbour] - 1;
      const bool is_lower = j >= 0 && j < i, is_same = j > i && j < ring_end, is_later = j >= ring_end;
      lower[lowers] = j;
      lowers += is_lower;
      same[sames] = j;
      sames += is_same;
      later[laters] = j;
      laters += is_later;
      if (k == first) first_lower = is_lower;
      const bool whole = is_lower && was_lower;
      triangles += whole;
      area += whole ? area_before : 0;
      was_lower = is_lower;
      area_before = mesh_.links[k].area_m2;
    }
    if (first_lower && was_lower && last - first > 2) {
      ++triangles;
      area += area_before;
    }
    std::copy(same, same + sames, lower + lowers);
    std::copy(later, later + laters, lower + lowers + sames);
    middle_[i] = static_cast<int>(begin) + lowers;
    outer_[i] = middle_[i] + sames;
    start_[i + 1] = outer_[i] + laters;
    near_.resize(static_cast<std::size_t>(start_[i + 1]));
    own_[i] = {area, triangles, 1 - lowers + triangles};
  }
  if (quantum_m <= 0) return;
  weight_.resize(near_.size());
  for (int i = 0; i < size(); ++i)
    for (int k = start_[i]; k < start_[i + 1]; ++k) {
      const double length = (mesh_.position(order_[i]) - mesh_.position(order_[near_[k]])).norm();
      weight_[k] = static_cast<std::uint32_t>(std::min(length / quantum_m, 0x1p30) + 0.5);
    }
}

RegionView Region::view() const {
  return {size(), patch_, rings(), ring_start_.data(), start_.data(), middle_.data(), outer_.data(), near_.data(),
          weight_.data()};
}

}  // namespace geocage::topology
