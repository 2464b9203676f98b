#include "topology/ball_axes.h"

// One pass of this file for each instruction set: plain code, SSE 4, AVX2, AVX-512.
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_AVX3_DL)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "topology/ball_axes.cpp"
#include <hwy/foreach_target.h>
//
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace geocage::topology {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using Doubles = hn::CappedTag<double, 8>;
using Double = hn::Vec<Doubles>;
using Places = hn::RebindToSigned<Doubles>;
constexpr int width = static_cast<int>(hn::MaxLanes(Doubles()));

struct Vector {
  Double x, y, z;
};

HWY_INLINE Double dot(const Vector& a, const Vector& b) {
  return hn::Add(hn::Add(hn::Mul(a.x, b.x), hn::Mul(a.y, b.y)), hn::Mul(a.z, b.z));
}
HWY_INLINE Vector cross(const Vector& a, const Vector& b) {
  return {hn::Sub(hn::Mul(a.y, b.z), hn::Mul(a.z, b.y)), hn::Sub(hn::Mul(a.z, b.x), hn::Mul(a.x, b.z)),
          hn::Sub(hn::Mul(a.x, b.y), hn::Mul(a.y, b.x))};
}

/// The largest root t of t^3 - 3 t - 2 r = 0 for r in [-1, 1]: 2 cos(acos(r) / 3), in [1, 2]. The start is a
/// parabola in cos(acos(r) / 2), within 0.01 of it everywhere and as near as the root's distance from the
/// next where both meet; each step squares that.
HWY_INLINE Double largest_root(Double r) {
  const Doubles d;
  const auto one = hn::Set(d, 1.0), three = hn::Set(d, 3.0);
  const auto c = hn::Sqrt(hn::Mul(hn::Add(one, r), hn::Set(d, 0.5)));
  auto t = hn::Add(one, hn::Mul(c, hn::Sub(hn::Set(d, 1.1547), hn::Mul(c, hn::Set(d, 0.1547)))));
  for (int step = 0; step < 4; ++step) {
    const auto tt = hn::Mul(t, t);
    const auto value = hn::Sub(hn::Mul(t, hn::Sub(tt, three)), hn::Add(r, r));
    const auto slope = hn::Mul(three, hn::Sub(tt, one));
    const auto steep = hn::Gt(slope, hn::Set(d, 1e-12));
    t = hn::Sub(t, hn::IfThenElseZero(steep, hn::Div(value, hn::IfThenElse(steep, slope, one))));
  }
  return hn::Min(hn::Max(t, one), hn::Set(d, 2.0));
}

void PrincipalAxes(const double* sums, int count, double guard, LaneAxes& axes) {
  const Doubles d;
  const auto rows = hn::Mul(hn::Iota(Places(), 0), hn::Set(Places(), std::int64_t{sum_slots}));
  const auto zero = hn::Zero(d), one = hn::Set(d, 1.0);
  for (int l = 0; l < count; l += width) {
    const auto sum = [&](int slot) {
      return hn::GatherIndex(d, sums + static_cast<std::ptrdiff_t>(l) * sum_slots + slot, rows);
    };
    const auto n = hn::Max(sum(slot_count), one);  // lanes beyond the patch hold nothing
    const Vector mean{hn::Div(sum(slot_x), n), hn::Div(sum(slot_y), n), hn::Div(sum(slot_z), n)};
    const Vector weighted{hn::Mul(n, mean.x), hn::Mul(n, mean.y), hn::Mul(n, mean.z)};
    const auto xx = hn::Sub(sum(slot_xx), hn::Mul(weighted.x, mean.x)),
               xy = hn::Sub(sum(slot_xy), hn::Mul(weighted.x, mean.y)),
               xz = hn::Sub(sum(slot_xz), hn::Mul(weighted.x, mean.z)),
               yy = hn::Sub(sum(slot_yy), hn::Mul(weighted.y, mean.y)),
               yz = hn::Sub(sum(slot_yz), hn::Mul(weighted.y, mean.z)),
               zz = hn::Sub(sum(slot_zz), hn::Mul(weighted.z, mean.z));
    // S = m I + p T, where T has no trace and the eigenvalues t.
    const auto m = hn::Div(hn::Add(hn::Add(xx, yy), zz), hn::Set(d, 3.0));
    const auto dx = hn::Sub(xx, m), dy = hn::Sub(yy, m), dz = hn::Sub(zz, m);
    const auto off = hn::Add(hn::Add(hn::Mul(xy, xy), hn::Mul(xz, xz)), hn::Mul(yz, yz));
    const auto on = hn::Add(hn::Add(hn::Mul(dx, dx), hn::Mul(dy, dy)), hn::Mul(dz, dz));
    const auto p = hn::Sqrt(hn::Div(hn::Add(on, hn::Add(off, off)), hn::Set(d, 6.0)));
    const auto some = hn::Gt(p, zero);
    const auto determinant = dot({dx, xy, xz}, cross({xy, dy, yz}, {xz, yz, dz}));
    const auto ppp = hn::IfThenElse(some, hn::Mul(p, hn::Mul(p, p)), one);
    const auto ratio = hn::Div(determinant, hn::Add(ppp, ppp));
    const auto t = largest_root(hn::Min(hn::Max(ratio, hn::Set(d, -1.0)), one));
    const auto rest = hn::Max(zero, hn::Sub(hn::Set(d, 12.0), hn::Mul(hn::Set(d, 3.0), hn::Mul(t, t))));
    const auto next = hn::Mul(hn::Sub(hn::Sqrt(rest), t), hn::Set(d, 0.5));
    const auto first = hn::Add(m, hn::Mul(p, t)), second = hn::Add(m, hn::Mul(p, next));

    const Vector row[3] = {
        {hn::Sub(xx, first), xy, xz}, {xy, hn::Sub(yy, first), yz}, {xz, yz, hn::Sub(zz, first)}};
    Vector best = cross(row[0], row[1]);
    auto length2 = dot(best, best);
    for (const Vector& other : {cross(row[0], row[2]), cross(row[1], row[2])}) {
      const auto other2 = dot(other, other);
      const auto longer = hn::Gt(other2, length2);
      best = {hn::IfThenElse(longer, other.x, best.x), hn::IfThenElse(longer, other.y, best.y),
              hn::IfThenElse(longer, other.z, best.z)};
      length2 = hn::IfThenElse(longer, other2, length2);
    }
    const auto length = hn::Sqrt(length2);
    const auto sure = hn::Gt(length, hn::Mul(hn::Set(d, 1e-3), hn::Mul(first, first)));
    const auto by = hn::Div(one, hn::IfThenElse(sure, length, one));
    hn::Store(mean.x, d, axes.mean[0] + l);
    hn::Store(mean.y, d, axes.mean[1] + l);
    hn::Store(mean.z, d, axes.mean[2] + l);
    hn::Store(hn::Mul(best.x, by), d, axes.axis[0] + l);
    hn::Store(hn::Mul(best.y, by), d, axes.axis[1] + l);
    hn::Store(hn::Mul(best.z, by), d, axes.axis[2] + l);
    const auto dominant = hn::And(hn::Gt(first, zero), hn::Ge(first, hn::Mul(hn::Set(d, guard), second)));
    const auto bits = [&](auto mask) {
      std::uint8_t bytes[8] = {};
      hn::StoreMaskBits(d, mask, bytes);
      return bytes[0];
    };
    const int are = bits(some), sures = bits(sure), dominants = bits(dominant);
    for (int k = 0; k < width; ++k)
      axes.state[l + k] = !(are >> k & 1)      ? LaneAxes::none
                          : !(sures >> k & 1)  ? LaneAxes::unsure
                          : dominants >> k & 1 ? LaneAxes::dominant
                                               : LaneAxes::none;
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace geocage::topology
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace geocage::topology {

HWY_EXPORT(PrincipalAxes);

void principal_axes(const double* sums, int count, double guard, LaneAxes& axes) {
  HWY_DYNAMIC_DISPATCH(PrincipalAxes)(sums, count, guard, axes);
}

}  // namespace geocage::topology
#endif
