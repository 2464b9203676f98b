#include "geometry/nearest_packet.h"

#include <cstring>

// One pass of this file for each instruction set: plain code, SSE 4, AVX2, AVX-512.
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_AVX3_DL)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "geometry/nearest_packet.cpp"
#include <hwy/foreach_target.h>
//
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace geocage::geometry {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using Tag = hn::CappedTag<double, Packet::size>;
using Places = hn::RebindToSigned<Tag>;
using Lanes = hn::Vec<Tag>;
constexpr int width = static_cast<int>(hn::MaxLanes(Tag()));
constexpr int vectors = Packet::size / width;

HWY_INLINE Lanes dot(const double* a, Lanes x, Lanes y, Lanes z) {
  const Tag d;
  return hn::Add(hn::Add(hn::Mul(hn::Set(d, a[0]), x), hn::Mul(hn::Set(d, a[1]), y)),
                 hn::Mul(hn::Set(d, a[2]), z));
}

/// Squared distance in the triangle's plane of (x, y) from the segment of `length` from (from, 0) along (u,
/// v), and how far outside it lies, with the triangle to the left.
struct Side {
  Lanes distance2, outside;
};
HWY_INLINE Side side(Lanes x, Lanes y, double from, double u, double v, double length) {
  const Tag d;
  const Lanes right = hn::Sub(x, hn::Set(d, from)), us = hn::Set(d, u), vs = hn::Set(d, v);
  const Lanes along = hn::Add(hn::Mul(us, right), hn::Mul(vs, y));
  const Lanes outside = hn::Sub(hn::Mul(vs, right), hn::Mul(us, y));
  const Lanes beyond = hn::Sub(along, hn::Min(hn::Max(along, hn::Zero(d)), hn::Set(d, length)));
  return {hn::Add(hn::Mul(beyond, beyond), hn::Mul(outside, outside)), outside};
}

HWY_INLINE void measure(const FlatTriangle* triangles, int place, Packet& packet) {
  const Tag d;
  const FlatTriangle& t = triangles[place];
  for (int k = 0; k < Packet::size; k += width) {
    const Lanes x = hn::Sub(hn::Load(d, packet.x + k), hn::Set(d, t.origin[0])),
                y = hn::Sub(hn::Load(d, packet.y + k), hn::Set(d, t.origin[1])),
                z = hn::Sub(hn::Load(d, packet.z + k), hn::Set(d, t.origin[2]));
    const Lanes best = hn::Load(d, packet.least2 + k);
    const Lanes height = dot(t.axes + 6, x, y, z), height2 = hn::Mul(height, height);
    if (hn::AllFalse(d, hn::Lt(height2, best))) continue;
    const Lanes along = dot(t.axes, x, y, z), across = dot(t.axes + 3, x, y, z);
    const Side first = side(along, across, 0, 1, 0, t.length);
    const Side second = side(along, across, 0, t.second[0], t.second[1], t.second[2]);
    const Side third = side(along, across, t.length, t.third[0], t.third[1], t.third[2]);
    // To the left of the first and the third side, and to the right of the second, which runs the other way.
    const Lanes outside = hn::Max(hn::Max(first.outside, hn::Neg(second.outside)), third.outside);
    const Lanes to_sides = hn::Min(hn::Min(first.distance2, second.distance2), third.distance2);
    const Lanes in_plane = hn::IfThenElseZero(hn::Gt(outside, hn::Zero(d)), to_sides);
    const Lanes distance2 = hn::Add(height2, in_plane);
    const auto nearer = hn::Lt(distance2, best);
    if (hn::AllFalse(d, nearer)) continue;
    const Places p;
    hn::Store(hn::IfThenElse(nearer, distance2, best), d, packet.least2 + k);
    hn::Store(hn::IfThenElse(hn::RebindMask(p, nearer), hn::Set(p, place), hn::Load(p, packet.nearest + k)),
              p, packet.nearest + k);
  }
}

/// Squared distances of the points from a box.
HWY_INLINE void to_box(const TurnedBox& box, const Packet& packet, double* distance2) {
  const Tag d;
  for (int k = 0; k < Packet::size; k += width) {
    const Lanes x = hn::Load(d, packet.x + k), y = hn::Load(d, packet.y + k), z = hn::Load(d, packet.z + k);
    Lanes sum = hn::Zero(d);
    for (std::ptrdiff_t i = 0; i < 3; ++i) {
      const Lanes along = hn::Sub(dot(box.axes + 3 * i, x, y, z), hn::Set(d, box.middle[i]));
      const Lanes beyond = hn::Max(hn::Sub(hn::Abs(along), hn::Set(d, box.half[i])), hn::Zero(d));
      sum = hn::Add(sum, hn::Mul(beyond, beyond));
    }
    hn::Store(sum, d, distance2 + k);
  }
}

HWY_INLINE bool may_be_nearer(const double* distance2, const Packet& packet) {
  const Tag d;
  for (int k = 0; k < Packet::size; k += width)
    if (!hn::AllFalse(d, hn::Lt(hn::Load(d, distance2 + k), hn::Load(d, packet.least2 + k)))) return true;
  return false;
}

/// Whether most points are nearer to a than to b.
HWY_INLINE bool most_nearer(const double* a, const double* b) {
  const Tag d;
  std::size_t count = 0;
  for (int k = 0; k < Packet::size; k += width)
    count += hn::CountTrue(d, hn::Le(hn::Load(d, a + k), hn::Load(d, b + k)));
  return count >= Packet::size / 2;
}

void MeasurePlace(const FlatTriangle* triangles, int place, Packet& packet) {
  measure(triangles, place, packet);
}

void MeasureNearest(const TurnedBox* boxes, const FlatTriangle* triangles, Packet& packet) {
  struct alignas(64) Waiting {
    double distance2[Packet::size];
    int box;
  };
  Waiting stack[64];  // triangles are halved: room for 2^64 of them
  alignas(64) double left2[Packet::size];
  int waiting = 0, at = 0;
  while (true) {
    const TurnedBox& box = boxes[at];
    if (box.count == 0) {
      const int left = at + 1, right = box.next;
      Waiting& later = stack[waiting];
      to_box(boxes[left], packet, left2);
      to_box(boxes[right], packet, later.distance2);
      const bool to_left = may_be_nearer(left2, packet), to_right = may_be_nearer(later.distance2, packet);
      if (to_left && to_right) {
        at = left;
        later.box = right;
        if (!most_nearer(left2, later.distance2)) {
          at = right;
          later.box = left;
          std::memcpy(later.distance2, left2, sizeof left2);
        }
        ++waiting;
        continue;
      }
      if (to_left || to_right) {
        at = to_left ? left : right;
        continue;
      }
    } else {
      for (int i = 0; i < box.count; ++i) measure(triangles, box.next + i, packet);
    }
    do {
      if (waiting == 0) return;
      --waiting;
    } while (!may_be_nearer(stack[waiting].distance2, packet));
    at = stack[waiting].box;
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace geocage::geometry
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace geocage::geometry {

HWY_EXPORT(MeasurePlace);
HWY_EXPORT(MeasureNearest);

void measure_place(const FlatTriangle* triangles, int place, Packet& packet) {
  HWY_DYNAMIC_DISPATCH(MeasurePlace)(triangles, place, packet);
}

void measure_nearest(const TurnedBox* boxes, const FlatTriangle* triangles, Packet& packet) {
  HWY_DYNAMIC_DISPATCH(MeasureNearest)(boxes, triangles, packet);
}

}  // namespace geocage::geometry
#endif
