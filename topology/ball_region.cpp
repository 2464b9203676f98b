#include "topology/ball_region.h"

#include <algorithm>
#include <cmath>
#include <functional>

namespace geocage::topology {

Patches::Patches(const BallMesh& mesh)
    : mesh_(mesh),
      start_(1, 0),
      taken_(static_cast<std::size_t>(mesh.count)),
      slot_(static_cast<std::size_t>(mesh.count) + 1) {
  members_.reserve(static_cast<std::size_t>(mesh.count));
}

std::span<const int> Patches::next() {
  const std::lock_guard lock(mutex_);
  if (given_out_ + 1 == start_.size()) make_next();
  if (given_out_ + 1 == start_.size()) return {};
  const int begin = start_[given_out_], end = start_[++given_out_];
  return {members_.data() + begin, static_cast<std::size_t>(end - begin)};
}

void Patches::make_next() {
  constexpr int farthest_seen = 6 * lanes;  // where no vertex is left nearby, a smaller patch it is
  while (seed_ < mesh_.count && taken_[seed_]) ++seed_;
  if (seed_ == mesh_.count) return;
  const GrowInput input{mesh_.link_start.data(), mesh_.links.neighbour.data(), mesh_.count, nullptr};
  queue_.assign(1, seed_);
  slot_[seed_] = slot_[mesh_.count] = 1;
  const std::size_t begin = members_.size(), full = begin + lanes;
  int reached = 1;
  for (int head = 0; head < reached && head < farthest_seen && members_.size() < full;) {
    const int ring = head, end = reached;
    std::size_t links = spare_links;
    for (; head < end && head < farthest_seen && members_.size() < full; ++head) {
      const int v = queue_[head];
      links += static_cast<std::size_t>(mesh_.link_start[v + 1] - mesh_.link_start[v]);
      if (taken_[v]) continue;
      taken_[v] = 1;
      members_.push_back(v);
    }
    if (head < end) break;
    queue_.resize(static_cast<std::size_t>(reached) + links);
    reached = grow_ring(input, queue_.data(), slot_.data(), ring, end, reached);
  }
  for (int i = 0; i < reached; ++i) slot_[queue_[i]] = 0;
  slot_[mesh_.count] = 0;
  const std::span<int> patch(members_.data() + begin, members_.size() - begin);
  for (int v : patch) slot_[v] = 1;
  order(patch);
  for (int v : patch) slot_[v] = 0;
  start_.push_back(static_cast<int>(members_.size()));
}

/// First what has no neighbour outside of its patch, which has the slots, then the others one after the other
/// round its middle: the rings of a region keep that order, so that a ball is few runs of each.
void Patches::order(std::span<int> patch) const {
  geometry::Vec3 middle = geometry::Vec3::Zero(), normal = middle;
  for (int v : patch) middle += mesh_.position(v);
  middle /= static_cast<double>(patch.size());
  const auto inner = [&](int v) {
    for (int i = mesh_.link_start[v]; i < mesh_.link_start[v + 1]; ++i)
      if (slot_[mesh_.links.neighbour[i]] == 0) return false;
    return true;
  };
  int *const begin = patch.data(), *const end = begin + patch.size();
  int* const border = std::stable_partition(begin, end, inner);
  for (const int* v = border; v < end; ++v) {
    const int first = mesh_.link_start[*v], last = mesh_.link_start[*v + 1];
    for (int i = first; i < last; ++i) {
      const int from = mesh_.links.neighbour[i], to = mesh_.links.neighbour[i + 1 < last ? i + 1 : first];
      if (from == mesh_.count || to == mesh_.count) continue;
      normal += (mesh_.position(from) - mesh_.position(*v)).cross(mesh_.position(to) - mesh_.position(*v));
    }
  }
  const geometry::Vec3 u = normal.unitOrthogonal(), w = normal.cross(u) / std::max(normal.norm(), 1e-300);
  std::pair<double, int> around[lanes];
  for (int* v = border; v < end; ++v) {
    const geometry::Vec3 out = mesh_.position(*v) - middle;
    const double x = out.dot(u), y = out.dot(w), far = std::abs(x) + std::abs(y);
    around[v - border] = {far > 0 ? std::copysign(1 - x / far, y) : 0, *v};  // grows with the angle
  }
  std::sort(around, around + (end - border));
  for (int* v = border; v < end; ++v) *v = around[v - border].second;
}

void Region::clear() {
  for (int i = 0; i < size_; ++i) slot_[order_[i]] = 0;
  size_ = 0;
  ring_start_.assign(1, 0);
  ring_low_.clear();
}

/// Ring by ring from the sources, at most `hops` of them; with `distance`, only what that has reached.
void Region::order_by_hops(const int* sources, int count, int hops, const std::uint32_t* distance) {
  clear();
  patch_ = count;
  order_.resize(static_cast<std::size_t>(mesh_.count) + 1 + spare_links);
  std::copy_n(sources, count, order_.data());
  for (int i = 0; i < count; ++i) slot_[order_[i]] = i + 1;
  slot_[mesh_.count] = 1;  // a gap is never new
  const GrowInput input{mesh_.link_start.data(), mesh_.links.neighbour.data(), mesh_.count, distance};
  int head = 0, reached = count;
  for (int depth = 0; head < reached; ++depth) {
    const int end = reached;
    ring_start_.push_back(end);
    ring_low_.push_back(static_cast<std::uint32_t>(depth));
    if (depth == hops) break;
    reached = grow_ring(input, order_.data(), slot_.data(), head, end, reached);
    head = end;
  }
  slot_[mesh_.count] = 0;
  size_ = reached;
}

void Region::grow_by_hops(const int* sources, int count, int hops) {
  order_by_hops(sources, count, hops, nullptr);
  link_region(nullptr);
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

/// Bucket by bucket (delta stepping: Meyer and Sanders 2003). What was reached is then ordered like a region
/// of hops, whose rings cut a ball into fewer runs than rings of lengths do.
void Region::grow_by_length(const int* sources, int count, std::uint32_t limit, const LinkWeights& weights) {
  constexpr std::uint32_t far = GrowInput::far;
  distance_.resize(static_cast<std::size_t>(mesh_.count) + 1, far);
  // No link leads round all buckets.
  width_ = std::max({weights.mean / 2, weights.longest / (buckets - 2), std::uint32_t{1}});
  for (int i = 0; i < count; ++i) distance_[sources[i]] = 0;
  for (int i = 0; i < count; ++i) reach_from(sources[i], limit, weights);
  for (std::uint32_t bucket = 0; waiting_ > 0; ++bucket) {
    auto& reached = buckets_[bucket % buckets];
    for (std::size_t k = 0; k < reached.size(); ++k) {
      const auto [d, v] = reached[k];
      --waiting_;
      if (d == distance_[v]) reach_from(v, limit, weights);
    }
    reached.clear();
  }
  order_by_hops(sources, count, mesh_.count, distance_.data());
  for (int ring = 0; ring < rings(); ++ring) {
    ring_low_[ring] = far;
    for (int i = ring_start_[ring]; i < ring_start_[ring + 1]; ++i)
      ring_low_[ring] = std::min(ring_low_[ring], distance_[order_[i]]);
  }
  for (int ring = rings() - 2; ring >= 0; --ring)
    ring_low_[ring] = std::min(ring_low_[ring], ring_low_[ring + 1]);
  for (int i = 0; i < size_; ++i) distance_[order_[i]] = far;
  link_region(weights.of_link.data());
}

/// Splits the neighbours of each vertex by the order, and adds up what ends at it.
void Region::link_region(const std::uint32_t* weights) {
  const auto n = static_cast<std::size_t>(size_);
  start_.resize(n + 1);
  middle_.resize(n);
  outer_.resize(n);
  own_.resize(n);
  farthest_.resize(n);
  std::size_t entries = spare_links;
  for (std::size_t i = 0; i < n; ++i)
    entries += static_cast<std::size_t>(mesh_.link_start[order_[i] + 1] - mesh_.link_start[order_[i]]);
  const auto make_room = [&](auto& list) {
    if (list.size() >= entries) return;
    list = {};  // never both at once
    list.shrink_to_fit();
    list.resize(entries + entries / 8);
  };
  make_room(near_);
  if (weights) make_room(weight_);
  start_[0] = 0;
  const LinkInput input{order_.data(),
                        slot_.data(),
                        mesh_.link_start.data(),
                        mesh_.links.neighbour.data(),
                        mesh_.links.area_m2.data(),
                        weights};
  const LinkOutput output{start_.data(),    middle_.data(), outer_.data(), near_.data(),
                          farthest_.data(), weight_.data(), own_.data()};
  for (int ring = 0; ring < rings(); ++ring)
    split_links(input, ring_start_[ring], ring_start_[ring + 1], output);
}

const std::vector<LengthSearch::Found>& LengthSearch::run(int source, double limit_m) {
  done_.resize(static_cast<std::size_t>(mesh_.count));
  for (const Found& f : found_) done_[f.vertex] = 0;
  found_.clear();
  heap_.assign(1, {0.0, source});
  while (!heap_.empty()) {
    std::pop_heap(heap_.begin(), heap_.end(), std::greater<>());
    const Found nearest = heap_.back();
    heap_.pop_back();
    if (done_[nearest.vertex]) continue;
    done_[nearest.vertex] = 1;
    found_.push_back(nearest);
    for (int i = mesh_.link_start[nearest.vertex]; i < mesh_.link_start[nearest.vertex + 1]; ++i) {
      const int w = mesh_.links.neighbour[i];
      if (w == mesh_.count || done_[w]) continue;
      const double next = nearest.distance_m + (mesh_.position(nearest.vertex) - mesh_.position(w)).norm();
      if (next > limit_m) continue;
      heap_.push_back({next, w});
      std::push_heap(heap_.begin(), heap_.end(), std::greater<>());
    }
  }
  return found_;
}

RegionView Region::view() const {
  return {size(),         patch_,        rings(),      ring_start_.data(), start_.data(),
          middle_.data(), outer_.data(), near_.data(), weight_.data()};
}

}  // namespace geocage::topology
