#include "topology/ball_region.h"

#include <algorithm>
#include <limits>

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
        const int w = mesh.links.neighbour[i];
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
  ring_low_.clear();
}

void Region::grow_by_hops(const int* sources, int count, int hops) {
  clear();
  patch_ = count;
  order_.resize(static_cast<std::size_t>(mesh_.count) + 1);
  int* const order = order_.data();
  int* const slot = slot_.data();
  std::copy_n(sources, count, order);
  for (int i = 0; i < count; ++i) slot[order[i]] = i + 1;
  slot[mesh_.count] = 1;  // a gap is never new
  int head = 0, reached = count;
  for (int depth = 0; head < reached; ++depth) {
    const int end = reached;
    ring_start_.push_back(end);
    ring_low_.push_back(static_cast<std::uint32_t>(depth));
    if (depth == hops) break;
    for (; head < end; ++head)
      for (int i = mesh_.link_start[order[head]]; i < mesh_.link_start[order[head] + 1]; ++i) {
        const int w = mesh_.links.neighbour[i];  // written always, kept if new: nothing to guess
        const bool fresh = slot[w] == 0;
        order[reached] = w;
        reached += fresh;
        slot[w] = fresh ? reached : slot[w];
      }
  }
  slot[mesh_.count] = 0;
  order_.resize(static_cast<std::size_t>(reached));
  link_region<false>(nullptr);
}

void Region::reach_from(int v, std::uint32_t limit, const LinkWeights& weights) {
  const std::uint32_t d = distance_[v];
  for (int i = mesh_.link_start[v]; i < mesh_.link_start[v + 1]; ++i) {
    const int w = mesh_.links.neighbour[i];
    const std::uint32_t next = d + weights.of_link[i];
    if (w == mesh_.count || next > limit || next >= distance_[w]) continue;
    distance_[w] = next;
    buckets_[next / width_ % buckets].push_back({next, w});
    ++waiting_;
  }
}

/// Bucket by bucket (delta stepping: Meyer and Sanders 2003): a vertex that is reached again from its own
/// bucket keeps its place in the order, and passes its new distance on.
void Region::grow_by_length(const int* sources, int count, std::uint32_t limit, const LinkWeights& weights) {
  constexpr std::uint32_t far = ~std::uint32_t{0};
  clear();
  patch_ = count;
  distance_.resize(static_cast<std::size_t>(mesh_.count), far);
  // No link leads round all buckets.
  width_ = std::max({weights.mean / 2, weights.longest / (buckets - 2), std::uint32_t{1}});
  for (int i = 0; i < count; ++i) {
    take(sources[i]);
    distance_[sources[i]] = 0;
  }
  ring_start_.push_back(count);
  ring_low_.push_back(0);
  std::uint32_t next_low = 0;
  for (int i = 0; i < count; ++i) reach_from(sources[i], limit, weights);
  for (std::uint32_t bucket = 0; waiting_ > 0; ++bucket) {
    auto& reached = buckets_[bucket % buckets];
    for (std::size_t k = 0; k < reached.size(); ++k) {
      const auto [d, v] = reached[k];
      --waiting_;
      if (d != distance_[v]) continue;
      if (slot_[v] == 0) take(v);
      reach_from(v, limit, weights);
    }
    reached.clear();
    if (bucket % 2 == 1 && size() > ring_start_.back()) {
      ring_start_.push_back(size());
      ring_low_.push_back(next_low);
      next_low = (bucket + 1) * width_;
    }
  }
  if (size() > ring_start_.back()) {
    ring_start_.push_back(size());
    ring_low_.push_back(next_low);
  }
  for (int v : order_) distance_[v] = far;
  link_region<true>(weights.of_link.data());
}

/// Splits the neighbours of each vertex by the order, and adds up what ends at it.
template <bool weighted>
void Region::link_region(const std::uint32_t* weights) {
  const std::size_t n = order_.size();
  start_.resize(n + 1);
  middle_.resize(n);
  outer_.resize(n);
  own_.resize(n);
  farthest_.resize(n);
  std::size_t entries = 0;
  for (int v : order_) entries += static_cast<std::size_t>(mesh_.link_start[v + 1] - mesh_.link_start[v]);
  const auto make_room = [&](auto& list) {
    if (list.size() >= entries) return;
    list = {};  // never both at once
    list.shrink_to_fit();
    list.resize(entries + entries / 8);
  };
  make_room(near_);
  if constexpr (weighted) make_room(weight_);
  start_[0] = 0;
  for (int ring = 0; ring < rings(); ++ring)
    for (int i = ring_start_[ring]; i < ring_start_[ring + 1]; ++i)
      link_vertex<weighted>(i, ring_start_[ring + 1], weights);
}

template <bool weighted>
void Region::link_vertex(int i, int ring_end, const std::uint32_t* weights) {
  const int first = mesh_.link_start[order_[i]], last = mesh_.link_start[order_[i] + 1];
  if (same_.size() < static_cast<std::size_t>(last - first)) {
    same_.resize(static_cast<std::size_t>(last - first));
    later_.resize(same_.size());
    same_weight_.resize(same_.size());
    later_weight_.resize(same_.size());
  }
  int* const lower = near_.data() + start_[i];
  std::uint32_t* const lower_weight = weighted ? weight_.data() + start_[i] : nullptr;
  int lowers = 0, sames = 0, laters = 0, triangles = 0, farthest = 0;
  double area = 0, area_before = mesh_.links.area_m2[last - 1];
  const int closing = slot_[mesh_.links.neighbour[last - 1]] - 1;
  bool was_lower = closing >= 0 && closing < i && last - first > 2;
  for (int k = first; k < last; ++k) {
    const int j = slot_[mesh_.links.neighbour[k]] - 1;
    const bool is_lower = j >= 0 && j<i, is_same = j> i && j < ring_end, is_later = j >= ring_end;
    lower[lowers] = j;
    same_[sames] = j;
    later_[laters] = j;
    if constexpr (weighted) lower_weight[lowers] = same_weight_[sames] = later_weight_[laters] = weights[k];
    lowers += is_lower;
    sames += is_same;
    laters += is_later;
    farthest = std::max(farthest, j < 0 ? std::numeric_limits<int>::max() : j);
    const bool whole = is_lower && was_lower;
    triangles += whole;
    area += whole ? area_before : 0;
    was_lower = is_lower;
    area_before = mesh_.links.area_m2[k];
  }
  const auto append = [&](int at, int count, const std::vector<int>& near,
                          const std::vector<std::uint32_t>& weight) {
    for (int k = 0; k < count; ++k) lower[at + k] = near[k];
    if constexpr (weighted)
      for (int k = 0; k < count; ++k) lower_weight[at + k] = weight[k];
  };
  append(lowers, sames, same_, same_weight_);
  append(lowers + sames, laters, later_, later_weight_);
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
