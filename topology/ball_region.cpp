#include "topology/ball_region.h"

#include <algorithm>
#include <cmath>
#include <limits>
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
    for (std::size_t head = 0; head < queue.size() && patches.sources.size() < full && head < farthest_seen;
         ++head) {
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
  farthest_.resize(n);
  std::size_t entries = 0;
  for (int v : order_) entries += static_cast<std::size_t>(mesh_.link_start[v + 1] - mesh_.link_start[v]);
  if (near_.size() < entries) near_.resize(entries + entries / 4);
  start_[0] = 0;
  for (int ring = 0; ring < rings(); ++ring)
    for (int i = ring_start_[ring]; i < ring_start_[ring + 1]; ++i) link_vertex(i, ring_start_[ring + 1]);
  if (quantum_m <= 0) return;
  weight_.resize(static_cast<std::size_t>(start_[n]));
  for (int i = 0; i < size(); ++i)
    for (int k = start_[i]; k < start_[i + 1]; ++k) {
      const double length = (mesh_.position(order_[i]) - mesh_.position(order_[near_[k]])).norm();
      weight_[k] = static_cast<std::uint32_t>(std::min(length / quantum_m, 0x1p30) + 0.5);
    }
}

void Region::link_vertex(int i, int ring_end) {
  const int first = mesh_.link_start[order_[i]], last = mesh_.link_start[order_[i] + 1];
  if (same_.size() < static_cast<std::size_t>(last - first)) {
    same_.resize(static_cast<std::size_t>(last - first));
    later_.resize(same_.size());
  }
  int* const lower = near_.data() + start_[i];
  int lowers = 0, sames = 0, laters = 0, triangles = 0, farthest = 0;
  double area = 0, area_before = mesh_.links[last - 1].area_m2;
  const int closing = slot_[mesh_.links[last - 1].neighbour] - 1;
  bool was_lower = closing >= 0 && closing < i && last - first > 2;
  for (int k = first; k < last; ++k) {
    const int j = slot_[mesh_.links[k].neighbour] - 1;
    const bool is_lower = j >= 0 && j<i, is_same = j> i && j < ring_end, is_later = j >= ring_end;
    lower[lowers] = j;
    lowers += is_lower;
    same_[sames] = j;
    sames += is_same;
    later_[laters] = j;
    laters += is_later;
    farthest = std::max(farthest, j < 0 ? std::numeric_limits<int>::max() : j);
    const bool whole = is_lower && was_lower;
    triangles += whole;
    area += whole ? area_before : 0;
    was_lower = is_lower;
    area_before = mesh_.links[k].area_m2;
  }
  for (int k = 0; k < sames; ++k) lower[lowers + k] = same_[k];
  for (int k = 0; k < laters; ++k) lower[lowers + sames + k] = later_[k];
  middle_[i] = start_[i] + lowers;
  outer_[i] = middle_[i] + sames;
  start_[i + 1] = outer_[i] + laters;
  own_[i] = {area, triangles, 1 - lowers + triangles};
  farthest_[i] = farthest;
}

RegionView Region::view() const {
  return {size(),         patch_,        rings(),      ring_start_.data(), start_.data(),
          middle_.data(), outer_.data(), near_.data(), weight_.data()};
}

}  // namespace geocage::topology
