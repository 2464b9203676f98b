#include "topology/ball_rows.h"

#include <bit>
#include <cstddef>
#include <cstring>
#include <limits>

// One pass of this file for each instruction set: plain code, SSE 4, AVX2, AVX-512.
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_AVX3_DL)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "topology/ball_rows.cpp"
#include <hwy/foreach_target.h>
//
#include <hwy/highway.h>
//
#include "topology/packed-inl.h"

HWY_BEFORE_NAMESPACE();
namespace geocage::topology {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

/// A row of 128 bytes in registers, and what it takes to bring a neighbour's row over.
template <class Lane>
struct Row {
  using Tag = hn::ScalableTag<Lane>;
  static constexpr int in_row = 128 / static_cast<int>(sizeof(Lane));
  static constexpr int width = static_cast<int>(hn::MaxLanes(Tag()));
  static constexpr int vectors = in_row / width;
  static constexpr Lane far = sizeof(Lane) == 1 ? Lane{255} : static_cast<Lane>(0x80000000u);
};

/// Row i gets the least of itself and its neighbours near[first .. last) one edge farther; true if that
/// changed what is below `beyond`: nothing else can lead to anything there. `fresh`: it holds nothing yet.
template <class Lane, bool fresh = false>
HWY_INLINE bool relax(const RegionView& region, Lane* rows, Lane beyond, int i, int first, int last) {
  using R = Row<Lane>;
  const typename R::Tag d;
  const auto bound = hn::Set(d, beyond);
  hn::Vec<typename R::Tag> least[R::vectors];
  for (int k = 0; k < R::vectors; ++k) least[k] = hn::Set(d, R::far);
  for (int n = first; n < last; ++n) {
    const Lane* from = rows + static_cast<std::ptrdiff_t>(region.near[n]) * R::in_row;
    if constexpr (sizeof(Lane) == 1) {
      for (int k = 0; k < R::vectors; ++k) least[k] = hn::Min(least[k], hn::Load(d, from + k * R::width));
    } else {
      const auto weight = hn::Set(d, region.weight[n]);
      for (int k = 0; k < R::vectors; ++k)
        least[k] = hn::Min(least[k], hn::Add(hn::Load(d, from + k * R::width), weight));
    }
  }
  Lane* to = rows + static_cast<std::ptrdiff_t>(i) * R::in_row;
  bool same = true;
  for (int k = 0; k < R::vectors; ++k) {
    if constexpr (sizeof(Lane) == 1) least[k] = hn::SaturatedAdd(least[k], hn::Set(d, Lane{1}));
    if constexpr (!fresh) {
      const auto old = hn::Load(d, to + k * R::width);
      least[k] = hn::Min(least[k], old);
      const auto known = hn::Min(old, bound);
      same &= hn::AllTrue(d, hn::Eq(hn::Min(least[k], known), known));
    }
    hn::Store(least[k], d, to + k * R::width);
  }
  return fresh || !same;
}

/// Row `to` gets the least of itself and row `from` one edge farther; true if that changed what is below
/// `beyond`, and false, with nothing done, otherwise.
template <class Lane>
HWY_INLINE bool offer(Lane* rows, Lane beyond, int from, int to, std::uint32_t weight) {
  using R = Row<Lane>;
  const typename R::Tag d;
  const auto bound = hn::Set(d, beyond);
  const Lane* source = rows + static_cast<std::ptrdiff_t>(from) * R::in_row;
  Lane* target = rows + static_cast<std::ptrdiff_t>(to) * R::in_row;
  hn::Vec<typename R::Tag> least[R::vectors];
  bool same = true;
  for (int k = 0; k < R::vectors; ++k) {
    const auto offered = hn::Load(d, source + k * R::width), old = hn::Load(d, target + k * R::width);
    if constexpr (sizeof(Lane) == 1)
      least[k] = hn::Min(old, hn::SaturatedAdd(offered, hn::Set(d, Lane{1})));
    else
      least[k] = hn::Min(old, hn::Add(offered, hn::Set(d, weight)));
    const auto known = hn::Min(old, bound);
    same &= hn::AllTrue(d, hn::Eq(hn::Min(least[k], known), known));
  }
  if (same) return false;
  for (int k = 0; k < R::vectors; ++k) hn::Store(least[k], d, target + k * R::width);
  return true;
}

/// Within [begin, end): what is dirty has changed and not told its neighbours; upwards and downwards in turn,
/// until nothing is.
template <class Lane>
void settle(const RegionView& region, Lane beyond, int begin, int end, Lane* rows, std::uint8_t* dirty) {
  bool any = true;
  const auto tell = [&](int i) {
    if (!dirty[i]) return;
    dirty[i] = 0;
    for (int n = region.start[i]; n < region.start[i + 1]; ++n) {
      const int to = region.near[n];
      if (to < begin || to >= end) continue;
      if (!offer(rows, beyond, i, to, sizeof(Lane) == 1 ? 1 : region.weight[n])) continue;
      dirty[to] = 1;
      any = true;
    }
  };
  while (any) {
    any = false;
    for (int i = begin; i < end; ++i) tell(i);
    if (!any) break;
    any = false;
    for (int i = end - 1; i >= begin; --i) tell(i);
  }
}

/// Rows of the patch among themselves (the first ring), from zeros at each lane's own source.
template <class Lane>
void start_rows(const RegionView& region, Lane beyond, int first, int count, Lane* rows,
                std::uint8_t* dirty) {
  constexpr int in_row = Row<Lane>::in_row;
  for (int i = 0; i < region.patch * in_row; ++i) rows[i] = Row<Lane>::far;
  for (int l = 0; l < count; ++l) rows[static_cast<std::ptrdiff_t>(first + l) * in_row + l] = 0;
  std::memset(dirty, 0, static_cast<std::size_t>(region.size));
  for (int sweep = 0; sweep < 2; ++sweep) {
    for (int i = 0; i < region.patch; ++i) relax(region, rows, beyond, i, region.start[i], region.outer[i]);
    for (int i = region.patch - 1; i >= 0; --i)
      dirty[i] |= static_cast<std::uint8_t>(relax(region, rows, beyond, i, region.start[i], region.outer[i]));
  }
  settle(region, beyond, 0, region.patch, rows, dirty);
}

/// Ring by ring outwards, each until nothing moves along it; what would move later rings again. Then once
/// inwards over all, and the rest where something moved. Ends at the one fixed point of row(i) = min(row(i),
/// edge + row of neighbours).
template <class Lane>
void fill_rows(const RegionView& region, Lane beyond, int first, int count, Lane* rows, std::uint8_t* dirty) {
  start_rows(region, beyond, first, count, rows, dirty);
  for (int ring = 1; ring < region.rings; ++ring) {
    const int begin = region.ring_start[ring], end = region.ring_start[ring + 1];
    for (int i = begin; i < end; ++i)
      relax<Lane, true>(region, rows, beyond, i, region.start[i], region.middle[i]);
    for (int i = end - 1; i >= begin; --i)
      dirty[i] = static_cast<std::uint8_t>(relax(region, rows, beyond, i, region.middle[i], region.outer[i]));
    settle(region, beyond, begin, end, rows, dirty);
  }
  for (int i = region.size - 1; i >= 0; --i)
    dirty[i] =
        static_cast<std::uint8_t>(relax(region, rows, beyond, i, region.middle[i], region.start[i + 1]));
  settle(region, beyond, 0, region.size, rows, dirty);
}

void HopRows(const RegionView& region, int limit, std::uint8_t* rows, std::uint8_t* dirty) {
  fill_rows(region, static_cast<std::uint8_t>(limit + 1), 0, region.patch, rows, dirty);
}

void LengthRows(const RegionView& region, std::uint32_t limit, int first, std::uint32_t* rows,
                std::uint8_t* dirty) {
  const int left = region.patch - first;
  fill_rows(region, limit + 1, first, left < length_lanes ? left : length_lanes, rows, dirty);
}

void HopMasks(const std::uint8_t* rows, int size, int limit, std::uint64_t* masks) {
  using R = Row<std::uint8_t>;
  const R::Tag d;
  const auto most = hn::Set(d, static_cast<std::uint8_t>(limit));
  auto* bytes = reinterpret_cast<std::uint8_t*>(masks);
  for (std::ptrdiff_t i = 0; i < size; ++i) {
    if constexpr (R::width < 8) std::memset(bytes + i * (lanes / 8), 0, lanes / 8);
    for (std::ptrdiff_t k = 0; k < R::vectors; ++k) {
      const auto row = hn::Load(d, rows + i * lanes + k * R::width);
      const auto within = hn::Eq(hn::Min(row, most), row);
      if constexpr (R::width >= 8)
        hn::StoreMaskBits(d, within, bytes + i * (lanes / 8) + k * (R::width / 8));
      else if (hn::AllTrue(d, within))
        bytes[i * (lanes / 8) + k / 8] |= static_cast<std::uint8_t>(1 << (k % 8));
    }
  }
}

std::uint32_t LengthMasks(const std::uint32_t* rows, int size, std::uint32_t limit, std::uint32_t slack,
                          int word, std::uint64_t* masks) {
  using R = Row<std::uint32_t>;
  const R::Tag d;
  const auto most = hn::Set(d, limit), low = hn::Set(d, limit - slack), high = hn::Set(d, limit + slack);
  const auto within = [&](hn::Vec<R::Tag> row, hn::Vec<R::Tag> bound) {
    return hn::Eq(hn::Min(row, bound), row);
  };
  auto* bytes = reinterpret_cast<std::uint8_t*>(masks);
  std::uint32_t close = 0;
  for (std::ptrdiff_t i = 0; i < size; ++i) {
    std::uint32_t bits = 0;
    for (std::ptrdiff_t k = 0; k < R::vectors; ++k) {
      const auto row = hn::Load(d, rows + i * R::in_row + k * R::width);
      std::uint8_t some[8] = {};
      hn::StoreMaskBits(d, within(row, most), some);
      std::uint32_t part = 0;
      std::memcpy(&part, some, sizeof(part));
      bits |= part << (k * R::width);
      const auto near = hn::AndNot(within(row, low), within(row, high));
      if (hn::AllFalse(d, near)) continue;
      hn::StoreMaskBits(d, near, some);
      std::memcpy(&part, some, sizeof(part));
      close |= part << (k * R::width);
    }
    std::memcpy(bytes + i * (lanes / 8) + static_cast<std::ptrdiff_t>(word) * 4, &bits, sizeof(bits));
  }
  return close;
}

using Doubles = hn::CappedTag<double, sum_slots>;
constexpr int double_width = static_cast<int>(hn::MaxLanes(Doubles()));

/// What a vertex adds to the sums.
HWY_INLINE void own_row(const SumInput& input, int i, double* row) {
  const double* p = input.points + 4 * static_cast<std::ptrdiff_t>(input.order[i]);
  const double x = p[0] - input.origin[0], y = p[1] - input.origin[1], z = p[2] - input.origin[2];
  row[slot_count] = 1;
  row[slot_x] = x;
  row[slot_y] = y;
  row[slot_z] = z;
  row[slot_defect] = p[3];
  row[slot_xx] = x * x;
  row[slot_xy] = x * y;
  row[slot_xz] = x * z;
  row[slot_yy] = y * y;
  row[slot_yz] = y * z;
  row[slot_zz] = z * z;
  row[slot_area] = input.own[i].area_m2;
  row[slot_triangles] = input.own[i].triangles;
  row[slot_euler] = input.own[i].euler;
  row[14] = row[15] = 0;
}

/// sums[l] -= prefix where a run begins, += prefix where one has ended, for the lanes in `changed`.
HWY_INLINE void turn_lanes(std::uint64_t changed, std::uint64_t begins, const double* prefix, double* sums) {
  const Doubles d;
  for (; changed; changed &= changed - 1) {
    const int l = std::countr_zero(changed);
    double* sum = sums + static_cast<std::ptrdiff_t>(l) * sum_slots;
    const auto sign = hn::BitCast(d, hn::Set(hn::RebindToUnsigned<Doubles>(), (begins >> l) << 63));
    for (int k = 0; k < sum_slots; k += double_width)
      hn::Store(hn::Add(hn::Load(d, sum + k), hn::Xor(hn::Load(d, prefix + k), sign)), d, sum + k);
  }
}

void LaneSums(const SumInput& input, int radii, const MaskRange* masks, double* sums) {
  constexpr int chunk = 32;
  const Doubles d;
  std::memset(sums, 0, sizeof(double) * static_cast<std::size_t>(radii) * lanes * sum_slots);
  alignas(128) double rows[chunk * sum_slots], prefix[sum_slots] = {};
  const auto row = [&rows](std::ptrdiff_t c) { return rows + c * sum_slots; };
  const auto lanes_of = [sums](std::ptrdiff_t q, std::ptrdiff_t w) {
    return sums + (q * lanes + 64 * w) * sum_slots;
  };
  for (int begin = 0; begin < input.size; begin += chunk) {
    const int count = input.size - begin < chunk ? input.size - begin : chunk;
    for (int c = begin + chunk; c < begin + 2 * chunk && c < input.size; ++c)
      __builtin_prefetch(input.points + 4 * static_cast<std::ptrdiff_t>(input.order[c]));
    for (int c = 0; c < count; ++c) own_row(input, begin + c, row(c));
    for (int k = 0; k < sum_slots; k += double_width) {
      auto sum = hn::Load(d, prefix + k);
      for (int c = 0; c < count; ++c) {
        const auto own = hn::Load(d, row(c) + k);
        hn::Store(sum, d, row(c) + k);
        sum = hn::Add(sum, own);
      }
      hn::Store(sum, d, prefix + k);
    }
    // Runs that begin at vertex 0 do so at a prefix of nothing.
    for (int q = 0; q < radii; ++q) {
      const int from = masks[q].inside > begin ? masks[q].inside - begin : begin == 0 ? 1 : 0;
      const int past = masks[q].end + 1 - begin < count ? masks[q].end + 1 - begin : count;
      for (int c = from; c < past; ++c) {
        const std::uint64_t* mask = masks[q].masks + static_cast<std::ptrdiff_t>(begin + c) * mask_words;
        for (int w = 0; w < mask_words; ++w) {
          const std::uint64_t before = mask[w - mask_words];
          if (mask[w] != before) turn_lanes(mask[w] ^ before, mask[w], row(c), lanes_of(q, w));
        }
      }
    }
  }
  for (int q = 0; q < radii && input.size > 0; ++q)
    for (int w = 0; w < mask_words; ++w)
      turn_lanes(masks[q].masks[static_cast<std::ptrdiff_t>(input.size - 1) * mask_words + w], 0, prefix,
                 lanes_of(q, w));
}

/// One neighbour at a time; any number of them.
HWY_INLINE int grow_plainly(const GrowInput& input, int* order, int* slot, int v, int reached) {
  for (int i = input.link_start[v]; i < input.link_start[v + 1]; ++i) {
    const int w = input.neighbour[i];  // written always, kept if new: nothing to guess
    const bool fresh = slot[w] == 0 && (!input.distance || input.distance[w] != GrowInput::far);
    order[reached] = w;
    reached += fresh;
    slot[w] = fresh ? reached : slot[w];
  }
  return reached;
}

/// Eight neighbours at a time, where vectors hold as many.
int GrowRing(const GrowInput& input, int* order, int* slot, int head, int end, int reached) {
  constexpr int ahead = 12;
  const hn::CappedTag<std::int32_t, spare_links> d;
  for (; head < end; ++head) {
    __builtin_prefetch(input.neighbour +
                       input.link_start[order[head + ahead < reached ? head + ahead : head]]);
    const int v = order[head], first = input.link_start[v], links = input.link_start[v + 1] - first;
    if constexpr (hn::MaxLanes(hn::CappedTag<std::int32_t, spare_links>()) == spare_links) {
      if (links <= spare_links) {
        const auto gap = hn::Set(d, input.gap);
        const auto there = hn::FirstN(d, static_cast<std::size_t>(links));
        const auto neighbour = hn::IfThenElse(there, hn::LoadU(d, input.neighbour + first), gap);
        auto fresh = hn::Eq(hn::GatherIndex(d, slot, neighbour), hn::Zero(d));
        if (input.distance) {
          const auto distance =
              hn::GatherIndex(d, reinterpret_cast<const std::int32_t*>(input.distance), neighbour);
          fresh = hn::AndNot(hn::Eq(distance, hn::Set(d, -1)), fresh);
        }
        const auto count = static_cast<int>(hn::CountTrue(d, fresh));
        const auto kept = hn::FirstN(d, static_cast<std::size_t>(count));
        hn::StoreU(hn::IfThenElse(kept, packed(d, neighbour, fresh), gap), d, order + reached);
        for (int j = 0; j < 3; ++j)
          slot[order[reached + j]] = reached + j + 1;  // seldom more; gaps don't mind
        for (int j = 3; j < count; ++j) slot[order[reached + j]] = reached + j + 1;
        reached += count;
        continue;
      }
    }
    reached = grow_plainly(input, order, slot, v, reached);
  }
  return reached;
}

/// Of areas around a vertex, those in `which`, up to eight: always added up the same way.
HWY_INLINE double some_areas(std::uint32_t which, const double* areas) {
  alignas(32) double sum[4];
  const hn::CappedTag<double, 4> d;
  if constexpr (hn::MaxLanes(hn::CappedTag<double, 4>()) == 4) {
    const std::uint8_t low[8] = {static_cast<std::uint8_t>(which & 15)};
    const std::uint8_t high[8] = {static_cast<std::uint8_t>(which >> 4)};
    hn::Store(hn::Add(hn::IfThenElseZero(hn::LoadMaskBits(d, low), hn::LoadU(d, areas)),
                      hn::IfThenElseZero(hn::LoadMaskBits(d, high), hn::LoadU(d, areas + 4))),
              d, sum);
  } else {
    const auto one = [&](int k) { return which >> k & 1 ? areas[k] : 0.0; };
    for (int k = 0; k < 4; ++k) sum[k] = one(k) + one(k + 4);
  }
  return (sum[0] + sum[2]) + (sum[1] + sum[3]);
}

/// A vertex' up to eight links in the order of its ring: `lower` has a bit for each neighbour that comes
/// before it.
HWY_INLINE OwnCells own_cells(std::uint32_t lower, int links, const double* areas) {
  const std::uint32_t next = lower >> 1 | (links > 2 ? lower << (links - 1) : 0);
  const std::uint32_t both = lower & next & ((1u << links) - 1);
  const int triangles = std::popcount(both);
  return {some_areas(both, areas), triangles, 1 - std::popcount(lower) + triangles};
}

/// One neighbour at a time; any number of them.
HWY_INLINE void split_plainly(const LinkInput& input, int i, int ring_end, const LinkOutput& output) {
  const int first = input.link_start[input.order[i]], last = input.link_start[input.order[i] + 1];
  const auto place = [&](int k) { return input.slot[input.neighbour[k]] - 1; };
  const auto is_lower = [&](int k) { return place(k) >= 0 && place(k) < i; };
  int next = output.start[i];
  const auto take = [&](auto&& wanted) {
    for (int k = first; k < last; ++k) {
      if (!wanted(place(k))) continue;
      output.near[next] = place(k);
      if (input.weight) output.weight[next] = input.weight[k];
      ++next;
    }
    return next;
  };
  output.middle[i] = take([&](int j) { return j >= 0 && j < i; });
  output.outer[i] = take([&](int j) { return j > i && j < ring_end; });
  output.start[i + 1] = take([&](int j) { return j >= ring_end; });
  OwnCells own = {0, 0, 1 - (output.middle[i] - output.start[i])};
  std::uint32_t lower = 0;
  int farthest = 0;
  for (int k = first; k < last; ++k) {
    const int next_link = k + 1 < last ? k + 1 : first;
    if (is_lower(k) && is_lower(next_link) && (k + 1 < last || last - first > 2)) {
      own.area_m2 += input.area_m2[k];
      ++own.triangles;
    }
    if (last - first <= spare_links) lower |= static_cast<std::uint32_t>(is_lower(k)) << (k - first);
    const int j = place(k) < 0 ? std::numeric_limits<int>::max() : place(k);
    if (j > farthest) farthest = j;
  }
  own.euler += own.triangles;
  output.own[i] = last - first > spare_links ? own : own_cells(lower, last - first, input.area_m2 + first);
  output.farthest[i] = farthest;
}

/// Eight neighbours at a time, where vectors hold as many.
void SplitLinks(const LinkInput& input, int begin, int end, const LinkOutput& output) {
  const hn::CappedTag<std::int32_t, spare_links> d;
  const hn::CappedTag<std::uint32_t, spare_links> du;
  using Vector = hn::Vec<decltype(d)>;
  if constexpr (hn::MaxLanes(hn::CappedTag<std::int32_t, spare_links>()) == spare_links) {
    constexpr int ahead = 12;
    const Vector one = hn::Set(d, 1), ring_end = hn::Set(d, end);
    for (int i = begin; i < end; ++i) {
      const int soon = input.link_start[input.order[i + ahead < end ? i + ahead : i]];
      __builtin_prefetch(input.area_m2 + soon);
      __builtin_prefetch(input.area_m2 + soon + 7);
      __builtin_prefetch(input.neighbour + soon);
      const int v = input.order[i], first = input.link_start[v], links = input.link_start[v + 1] - first;
      if (links > spare_links) {
        split_plainly(input, i, end, output);
        continue;
      }
      const auto there = hn::FirstN(d, static_cast<std::size_t>(links));
      const Vector neighbour = hn::IfThenElseZero(there, hn::LoadU(d, input.neighbour + first));
      const Vector place = hn::Sub(hn::GatherIndex(d, input.slot, neighbour), one);
      const Vector here = hn::Set(d, i);
      const auto inside = hn::And(there, hn::Gt(place, hn::Set(d, -1)));
      const auto lower = hn::And(inside, hn::Lt(place, here));
      const auto later = hn::And(there, hn::Gt(place, hn::Set(d, end - 1)));
      const auto same = hn::And(hn::And(there, hn::Gt(place, here)), hn::Lt(place, ring_end));
      const auto bits = [&](auto mask) {
        std::uint8_t bytes[8];
        hn::StoreMaskBits(d, mask, bytes);
        return static_cast<std::uint32_t>(bytes[0]);
      };
      const std::uint32_t lower_bits = bits(lower);
      const int start = output.start[i], middle = start + std::popcount(lower_bits),
                outer = middle + std::popcount(bits(same)), past = outer + std::popcount(bits(later));
      hn::StoreU(packed(d, place, lower), d, output.near + start);
      hn::StoreU(packed(d, place, same), d, output.near + middle);
      hn::StoreU(packed(d, place, later), d, output.near + outer);
      if (input.weight) {
        const auto weight = hn::LoadU(du, input.weight + first);
        hn::StoreU(packed(du, weight, hn::RebindMask(du, lower)), du, output.weight + start);
        hn::StoreU(packed(du, weight, hn::RebindMask(du, same)), du, output.weight + middle);
        hn::StoreU(packed(du, weight, hn::RebindMask(du, later)), du, output.weight + outer);
      }
      output.middle[i] = middle;
      output.outer[i] = outer;
      output.start[i + 1] = past;
      output.own[i] = own_cells(lower_bits, links, input.area_m2 + first);
      const auto outermost =
          hn::Min(hn::BitCast(du, hn::IfThenElseZero(there, place)), hn::Set(du, std::uint32_t{0x7fffffff}));
      output.farthest[i] = hn::GetLane(hn::MaxOfLanes(d, hn::BitCast(d, outermost)));
    }
  } else {
    for (int i = begin; i < end; ++i) split_plainly(input, i, end, output);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace geocage::topology
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace geocage::topology {

HWY_EXPORT(GrowRing);
HWY_EXPORT(SplitLinks);
HWY_EXPORT(HopRows);
HWY_EXPORT(LengthRows);
HWY_EXPORT(HopMasks);
HWY_EXPORT(LengthMasks);
HWY_EXPORT(LaneSums);

int grow_ring(const GrowInput& input, int* order, int* slot, int head, int end, int reached) {
  return HWY_DYNAMIC_DISPATCH(GrowRing)(input, order, slot, head, end, reached);
}

void split_links(const LinkInput& input, int begin, int end, const LinkOutput& output) {
  HWY_DYNAMIC_DISPATCH(SplitLinks)(input, begin, end, output);
}

void hop_rows(const RegionView& region, int limit, std::uint8_t* rows, std::uint8_t* dirty) {
  HWY_DYNAMIC_DISPATCH(HopRows)(region, limit, rows, dirty);
}

void length_rows(const RegionView& region, std::uint32_t limit, int first, std::uint32_t* rows,
                 std::uint8_t* dirty) {
  HWY_DYNAMIC_DISPATCH(LengthRows)(region, limit, first, rows, dirty);
}

void hop_masks(const std::uint8_t* rows, int size, int limit, std::uint64_t* masks) {
  HWY_DYNAMIC_DISPATCH(HopMasks)(rows, size, limit, masks);
}

std::uint32_t length_masks(const std::uint32_t* rows, int size, std::uint32_t limit, std::uint32_t slack,
                           int word, std::uint64_t* masks) {
  return HWY_DYNAMIC_DISPATCH(LengthMasks)(rows, size, limit, slack, word, masks);
}

void lane_sums(const SumInput& input, int radii, const MaskRange* masks, double* sums) {
  HWY_DYNAMIC_DISPATCH(LaneSums)(input, radii, masks, sums);
}

}  // namespace geocage::topology
#endif
