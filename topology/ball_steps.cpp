#include "topology/ball_steps.h"

#include <bit>
#include <cstddef>

// One pass of this file for each instruction set: plain code, SSE 4, AVX2, AVX-512.
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_AVX3_DL)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "topology/ball_steps.cpp"
#include <hwy/foreach_target.h>
//
#include <hwy/highway.h>
//
#include "topology/packed-inl.h"

HWY_BEFORE_NAMESPACE();
namespace geocage::topology {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using Doubles = hn::CappedTag<double, 8>;
using Words = hn::RebindToUnsigned<Doubles>;
using Whole = hn::RebindToSigned<Doubles>;
constexpr int width = static_cast<int>(hn::MaxLanes(Doubles()));

constexpr std::uint64_t nowhere = 0xffffffff;  // a half-edge that there is not

/// The walks under way, a lane each.
struct Lanes {
  alignas(64) double axis[3][width], offset[width], v_axis[3][width], center[3][width];
  alignas(64) double height[2][width], along[2][width], v[width];
  alignas(64) std::uint64_t half_edge[width], home[width], ends[2][width], from_above[width], bit[width];
  /// Of the triangle that is entered: the half-edge's two words, and the vertex opposite.
  alignas(64) std::uint64_t first[width], second[width], vertex[width];
  const std::uint64_t* masks[width];
  SectionSteps* walk[width];
  std::uint32_t active = 0, noting = 0, notes_only = 0;

  void idle(int l) {
    half_edge[l] = nowhere;
    active &= ~(1u << l);
    noting &= ~(1u << l);
    notes_only &= ~(1u << l);
  }

  void begin(int l, SectionSteps& next) {
    const CutPlane& plane = *next.plane;
    const WalkTip& tip = *next.tip;
    for (int i = 0; i < 3; ++i) {
      axis[i][l] = plane.axis[i];
      v_axis[i][l] = plane.v[i];
      center[i][l] = plane.center[i];
    }
    offset[l] = plane.offset;
    for (int i = 0; i < 2; ++i) {
      height[i][l] = tip.places[i].height;
      along[i][l] = tip.places[i].v;
      ends[i][l] = static_cast<std::uint32_t>(tip.ends[i]);
    }
    v[l] = tip.v;
    half_edge[l] = static_cast<std::uint32_t>(tip.half_edge);
    home[l] = static_cast<std::uint32_t>(tip.home);
    from_above[l] = tip.from_above ? ~std::uint64_t{0} : 0;
    bit[l] = next.bit;
    masks[l] = next.masks;
    walk[l] = &next;
    active |= 1u << l;
    noting |= 1u << l;
    notes_only = (notes_only & ~(1u << l)) | static_cast<std::uint32_t>(next.notes_only) << l;
  }

  void end(int l) {
    WalkTip& tip = *walk[l]->tip;
    for (int i = 0; i < 2; ++i) {
      tip.places[i] = {height[i][l], along[i][l]};
      tip.ends[i] = static_cast<int>(ends[i][l]);
    }
    tip.v = v[l];
    tip.half_edge = static_cast<int>(static_cast<std::uint32_t>(half_edge[l]));
  }
};

template <class Mask>
HWY_INLINE std::uint32_t bits_of(Mask mask) {
  std::uint8_t bytes[8] = {};
  hn::StoreMaskBits(Doubles(), mask, bytes);
  return bytes[0];
}

/// Whether the walk passes the half-line u < 0, v = 0 from one cut point to the next, and which way.
HWY_INLINE int turn_between(const Lanes& lanes, int l, const StepInput& input, double old_v,
                            const int* old_ends, const CutEnd* old_places) {
  const CutPlane& plane = *lanes.walk[l]->plane;
  const int ends[2] = {static_cast<int>(lanes.ends[0][l]), static_cast<int>(lanes.ends[1][l])};
  const CutEnd places[2] = {{lanes.height[0][l], lanes.along[0][l]}, {lanes.height[1][l], lanes.along[1][l]}};
  const double u = along_u(plane, input.points, ends, places), v = lanes.v[l];
  const double cross = along_u(plane, input.points, old_ends, old_places) * v - u * old_v;
  return v < 0 && cross > 0 ? 1 : v >= 0 && cross < 0 ? -1 : 0;
}

// gather_pairs: records of two words, one a lane, into their first and second words. gather_points: points of
// four numbers into the first three. Loads and shuffles take less time than gathering.
#if HWY_TARGET == HWY_AVX3
template <class Vector>
HWY_INLINE void gather_pairs(const std::uint64_t* from, const std::uint64_t* at, Vector& first,
                             Vector& second) {
  const Words w;
  const hn::Half<Words> half;
  const hn::Half<hn::Half<Words>> pair;
  const auto record = [&](int l) { return hn::LoadU(pair, from + 2 * at[l]); };
  const auto even = hn::Combine(w, hn::Combine(half, record(6), record(4)),
                                hn::Combine(half, record(2), record(0))),
             odd = hn::Combine(w, hn::Combine(half, record(7), record(5)),
                               hn::Combine(half, record(3), record(1)));
  first = hn::InterleaveLower(w, even, odd);
  second = hn::InterleaveUpper(w, even, odd);
}

template <class Vector>
HWY_INLINE void gather_points(const double* from, const std::uint64_t* at, Vector& x, Vector& y, Vector& z) {
  const Doubles d;
  const hn::Half<Doubles> half;
  const auto points = [&](int l) {
    return hn::Combine(d, hn::LoadU(half, from + 4 * at[l + 4]), hn::LoadU(half, from + 4 * at[l]));
  };
  const auto p0 = points(0), p1 = points(1), p2 = points(2), p3 = points(3);
  const auto low01 = hn::InterleaveLower(d, p0, p1), low23 = hn::InterleaveLower(d, p2, p3);
  const auto high01 = hn::InterleaveUpper(d, p0, p1), high23 = hn::InterleaveUpper(d, p2, p3);
  x = hn::OddEvenBlocks(hn::SwapAdjacentBlocks(low23), low01);
  y = hn::OddEvenBlocks(hn::SwapAdjacentBlocks(high23), high01);
  z = hn::OddEvenBlocks(low23, hn::SwapAdjacentBlocks(low01));
}
#elif HWY_TARGET == HWY_AVX2
template <class Vector>
HWY_INLINE void gather_pairs(const std::uint64_t* from, const std::uint64_t* at, Vector& first,
                             Vector& second) {
  const Words w;
  const hn::Half<Words> pair;
  const auto records = [&](int l) {
    return hn::Combine(w, hn::LoadU(pair, from + 2 * at[l + 2]), hn::LoadU(pair, from + 2 * at[l]));
  };
  const auto even = records(0), odd = records(1);
  first = hn::InterleaveLower(w, even, odd);
  second = hn::InterleaveUpper(w, even, odd);
}

template <class Vector>
HWY_INLINE void gather_points(const double* from, const std::uint64_t* at, Vector& x, Vector& y, Vector& z) {
  const Doubles d;
  const auto point = [&](int l) { return hn::LoadU(d, from + 4 * at[l]); };
  const auto p0 = point(0), p1 = point(1), p2 = point(2), p3 = point(3);
  const auto low01 = hn::InterleaveLower(d, p0, p1), low23 = hn::InterleaveLower(d, p2, p3);
  x = hn::ConcatLowerLower(d, low23, low01);
  y = hn::ConcatLowerLower(d, hn::InterleaveUpper(d, p2, p3), hn::InterleaveUpper(d, p0, p1));
  z = hn::ConcatUpperUpper(d, low23, low01);
}
#else
template <class Vector>
HWY_INLINE void gather_pairs(const std::uint64_t* from, const std::uint64_t* at, Vector& first,
                             Vector& second) {
  const Words w;
  const auto record = hn::BitCast(Whole(), hn::ShiftLeft<4>(hn::Load(w, at)));
  first = hn::GatherOffset(w, from, record);
  second = hn::GatherOffset(w, from + 1, record);
}

template <class Vector>
HWY_INLINE void gather_points(const double* from, const std::uint64_t* at, Vector& x, Vector& y, Vector& z) {
  const Doubles d;
  const auto point = hn::BitCast(Whole(), hn::ShiftLeft<5>(hn::Load(Words(), at)));
  x = hn::GatherOffset(d, from, point);
  y = hn::GatherOffset(d, from + 1, point);
  z = hn::GatherOffset(d, from + 2, point);
}
#endif

/// What each lane's half-edge leads to; half-edge 0 stands in for none.
HWY_INLINE void look_ahead(const StepInput& input, Lanes& lanes) {
  const Words w;
  const auto* const records = reinterpret_cast<const std::uint64_t*>(input.half_edges);
  const auto half_edge = hn::Load(w, lanes.half_edge);
  const auto somewhere = hn::IfThenZeroElse(hn::Eq(half_edge, hn::Set(w, nowhere)), half_edge);
  alignas(64) std::uint64_t at[width];
  hn::Store(somewhere, w, at);
  hn::Vec<Words> first, second;
  gather_pairs(records, at, first, second);
  hn::Store(first, w, lanes.first);
  hn::Store(second, w, lanes.second);
  hn::Store(hn::And(first, hn::Set(w, std::uint64_t{0xffffffff})), w, lanes.vertex);
}

/// The lanes whose walks can't go on: there is no triangle, or its third corner is not in the ball.
HWY_INLINE std::uint32_t staying(const StepInput& input, const Lanes& lanes) {
  std::uint32_t stays = 0;
  for (int l = 0; l < width; ++l) {
    const std::uint64_t mask = lanes.masks[l][2 * static_cast<std::ptrdiff_t>(input.slot[lanes.vertex[l]])];
    const bool stay = (mask & lanes.bit[l]) == 0 || lanes.half_edge[l] == nowhere;
    stays |= static_cast<std::uint32_t>(stay) << l;
  }
  return stays;
}

/// All active lanes go through their next triangle, but for those that stay. Which way a walk leaves it is a
/// toss-up, so that nothing branches on it. Returns the lanes whose walks have ended.
HWY_INLINE std::uint32_t step(const StepInput& input, std::uint32_t stays, Lanes& lanes) {
  const Doubles d;
  const Words w;
  const auto* const records = reinterpret_cast<const std::uint64_t*>(input.half_edges);
  const auto low = hn::Set(w, std::uint64_t{0xffffffff});
  const auto half_edge = hn::Load(w, lanes.half_edge), first = hn::Load(w, lanes.first),
             second = hn::Load(w, lanes.second), vertex = hn::Load(w, lanes.vertex);
  const std::uint8_t stay_bits[8] = {static_cast<std::uint8_t>(stays)};
  const auto stay = hn::LoadMaskBits(d, stay_bits);

  hn::Vec<Doubles> x, y, z;
  gather_points(input.points, lanes.vertex, x, y, z);
  const auto times = [&](const double(*by)[width], auto a, auto b, auto c) {
    return hn::Add(hn::Add(hn::Mul(hn::Load(d, by[0]), a), hn::Mul(hn::Load(d, by[1]), b)),
                   hn::Mul(hn::Load(d, by[2]), c));
  };
  const auto up = hn::Sub(times(lanes.axis, x, y, z), hn::Load(d, lanes.offset));
  const auto along =
      times(lanes.v_axis, hn::Sub(x, hn::Load(d, lanes.center[0])), hn::Sub(y, hn::Load(d, lanes.center[1])),
            hn::Sub(z, hn::Load(d, lanes.center[2])));
  const auto above = hn::Ge(up, hn::Zero(d));
  const auto take_above = hn::AndNot(stay, above), take_below = hn::Not(hn::Or(above, stay));
  const auto old_height0 = hn::Load(d, lanes.height[0]), old_height1 = hn::Load(d, lanes.height[1]);
  const auto old_along0 = hn::Load(d, lanes.along[0]), old_along1 = hn::Load(d, lanes.along[1]);
  const auto old_end0 = hn::Load(w, lanes.ends[0]), old_end1 = hn::Load(w, lanes.ends[1]);
  const auto old_v = hn::Load(d, lanes.v);
  const auto height0 = hn::IfThenElse(take_above, up, old_height0);
  const auto height1 = hn::IfThenElse(take_below, up, old_height1);
  const auto along0 = hn::IfThenElse(take_above, along, old_along0);
  const auto along1 = hn::IfThenElse(take_below, along, old_along1);
  const auto end0 = hn::IfThenElse(hn::RebindMask(w, take_above), vertex, old_end0);
  const auto end1 = hn::IfThenElse(hn::RebindMask(w, take_below), vertex, old_end1);
  // A tip that stays has its v already: the same products again.
  const auto v = hn::Sub(hn::Mul(height0, along1), hn::Mul(height1, along0));
  const auto from_above = hn::MaskFromVec(hn::Load(w, lanes.from_above));
  const auto second_exit = hn::Xor(hn::RebindMask(w, above), from_above);
  const auto exit = hn::IfThenElse(second_exit, hn::And(second, low), hn::ShiftRight<32>(first));
  const auto next = hn::IfThenElse(hn::RebindMask(w, stay), half_edge, exit);
  const auto home = hn::AndNot(hn::RebindMask(w, stay), hn::Eq(next, hn::Load(w, lanes.home)));
  const auto passes = hn::Xor(hn::Ge(v, hn::Zero(d)), hn::Ge(old_v, hn::Zero(d)));

  hn::Store(height0, d, lanes.height[0]);
  hn::Store(height1, d, lanes.height[1]);
  hn::Store(along0, d, lanes.along[0]);
  hn::Store(along1, d, lanes.along[1]);
  hn::Store(end0, w, lanes.ends[0]);
  hn::Store(end1, w, lanes.ends[1]);
  hn::Store(v, d, lanes.v);
  hn::Store(next, w, lanes.half_edge);
  for (int l = 0; l < width; ++l)  // needed when the other groups have had their steps
    if (lanes.half_edge[l] != nowhere) __builtin_prefetch(records + 2 * lanes.half_edge[l]);
  const std::uint32_t homes = bits_of(hn::RebindMask(d, home)) & lanes.active;
  for (std::uint32_t left = homes; left; left &= left - 1)
    lanes.walk[std::countr_zero(left)]->tip->closed = true;
  std::uint32_t ended = homes | (stays & lanes.active);

  if (std::uint32_t passing = bits_of(passes) & lanes.active & ~stays) {
    alignas(64) double heights[2][width], alongs[2][width], vs[width];
    alignas(64) std::uint64_t ends[2][width];
    hn::Store(old_height0, d, heights[0]);
    hn::Store(old_height1, d, heights[1]);
    hn::Store(old_along0, d, alongs[0]);
    hn::Store(old_along1, d, alongs[1]);
    hn::Store(old_end0, w, ends[0]);
    hn::Store(old_end1, w, ends[1]);
    hn::Store(old_v, d, vs);
    for (; passing; passing &= passing - 1) {
      const int l = std::countr_zero(passing);
      const int old_ends[2] = {static_cast<int>(ends[0][l]), static_cast<int>(ends[1][l])};
      const CutEnd places[2] = {{heights[0][l], alongs[0][l]}, {heights[1][l], alongs[1][l]}};
      lanes.walk[l]->tip->turns += turn_between(lanes, l, input, vs[l], old_ends, places);
    }
  }
  if (lanes.noting) {
    alignas(64) Crossing crossings[width];
    hn::Store(hn::Or(hn::ShiftLeft<32>(end0), end1), w, crossings);
    for (std::uint32_t left = lanes.noting & ~stays; left; left &= left - 1) {
      const int l = std::countr_zero(left);
      WalkTip& tip = *lanes.walk[l]->tip;
      tip.notes[tip.noted++] = crossings[l];
      if (tip.noted < WalkTip::most_noted) continue;
      lanes.noting &= ~(1u << l);
      ended |= lanes.notes_only & (1u << l);
    }
  }
  return ended;
}

void WalkSections(const StepInput& input, SectionSteps* walks, int count) {
  constexpr int groups = 4;  // some wait for memory while others go on
  if (count == 0) return;
  Lanes lanes[groups];
  int next = 0;
  for (int l = 0; l < width; ++l)
    for (Lanes& group : lanes) {
      group.from_above[l] = group.home[l] = group.ends[0][l] = group.ends[1][l] = 0;
      group.begin(l, walks[0]);  // numbers, whatever they are
      group.idle(l);
    }
  for (int l = 0; l < width; ++l)
    for (Lanes& group : lanes)
      if (next < count) group.begin(l, walks[next++]);
  for (std::uint32_t any = 1; any != 0;) {
    any = 0;
    std::uint32_t stays[groups];
    for (Lanes& group : lanes) look_ahead(input, group);
    for (int g = 0; g < groups; ++g) stays[g] = staying(input, lanes[g]);
    for (int g = 0; g < groups; ++g) {
      Lanes& group = lanes[g];
      for (std::uint32_t ended = step(input, stays[g], group); ended; ended &= ended - 1) {
        const int l = std::countr_zero(ended);
        group.end(l);
        if (next < count)
          group.begin(l, walks[next++]);
        else
          group.idle(l);
      }
      any |= group.active;
    }
  }
}

int NearVertices(const NearInput& input, const int* low, const int* high, const float* p, float radius,
                 int most, int* found) {
  const hn::CappedTag<float, 16> d;
  const hn::RebindToSigned<decltype(d)> di;
  const auto x = hn::Set(d, p[0]), y = hn::Set(d, p[1]), z = hn::Set(d, p[2]), r = hn::Set(d, radius);
  const int step = static_cast<int>(hn::Lanes(d));
  int count = 0;
  for (int cell_z = low[2]; cell_z <= high[2]; ++cell_z)
    for (int cell_y = low[1]; cell_y <= high[1]; ++cell_y) {
      const std::ptrdiff_t row =
          (static_cast<std::ptrdiff_t>(cell_z) * input.cells_y + cell_y) * input.cells_x;
      const int end = input.row_start[row + high[0] + 1];
      for (int i = input.row_start[row + low[0]]; i < end; i += step) {
        if (count > most) return -1;
        const auto dx = hn::Sub(hn::LoadU(d, input.x + i), x), dy = hn::Sub(hn::LoadU(d, input.y + i), y),
                   dz = hn::Sub(hn::LoadU(d, input.z + i), z);
        const auto reach = hn::Add(hn::LoadU(d, input.reach + i), r);
        const auto square = hn::Add(hn::Add(hn::Mul(dx, dx), hn::Mul(dy, dy)), hn::Mul(dz, dz));
        const auto there = hn::FirstN(d, static_cast<std::size_t>(end - i));
        const auto near = hn::And(there, hn::Le(square, hn::Mul(reach, reach)));
        const auto near_int = hn::RebindMask(di, near);
        hn::StoreU(packed(di, hn::LoadU(di, input.items + i), near_int), di, found + count);
        count += static_cast<int>(hn::CountTrue(di, near_int));
      }
    }
  return count > most ? -1 : count;
}

}  // namespace HWY_NAMESPACE
}  // namespace geocage::topology
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace geocage::topology {

HWY_EXPORT(WalkSections);
HWY_EXPORT(NearVertices);

void walk_sections(const StepInput& input, SectionSteps* walks, int count) {
  HWY_DYNAMIC_DISPATCH(WalkSections)(input, walks, count);
}

int near_vertices(const NearInput& input, const int* low, const int* high, const float* p, float radius,
                  int most, int* found) {
  return HWY_DYNAMIC_DISPATCH(NearVertices)(input, low, high, p, radius, most, found);
}

double along_u(const CutPlane& plane, const double* points, const int* ends, const CutEnd* places) {
  double u[2];
  for (int i = 0; i < 2; ++i) {
    const double* p = points + 4 * static_cast<std::ptrdiff_t>(ends[i]);
    u[i] = plane.u[0] * (p[0] - plane.center[0]) + plane.u[1] * (p[1] - plane.center[1]) +
           plane.u[2] * (p[2] - plane.center[2]);
  }
  return places[0].height * u[1] - places[1].height * u[0];
}

}  // namespace geocage::topology
#endif
