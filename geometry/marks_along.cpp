#include "geometry/marks_along.h"

#include <cstdint>

// One pass of this file for each instruction set: plain code, SSE 4, AVX2, AVX-512.
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_AVX3_DL)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "geometry/marks_along.cpp"
#include <hwy/foreach_target.h>
//
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace geocage::geometry {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using Tag = hn::CappedTag<double, 8>;
using Cells = hn::Rebind<std::int32_t, Tag>;

void MarksAlong(const GridSize& grid, const double* a, const double* ab, int last, int* index) {
  const Tag d;
  const Cells c;
  const int width = static_cast<int>(hn::Lanes(d));
  const int nx = (grid.nodes[0] + 2) >> 2, ny = (grid.nodes[1] + 2) >> 2;
  const int brick[3] = {64, 64 * nx, 64 * nx * ny}, within[3] = {1, 4, 16};
  const auto cell = hn::Set(d, grid.cell), whole = hn::Set(d, last);
  for (int i = 0; i <= last; i += width) {
    const auto t = hn::Div(hn::Iota(d, i), whole);
    auto at = hn::Zero(c);
    for (int axis = 0; axis < 3; ++axis) {
      const auto p = hn::Add(hn::Set(d, a[axis]), hn::Mul(t, hn::Set(d, ab[axis])));
      const auto q = hn::Div(hn::Sub(p, hn::Set(d, grid.origin[axis])), cell);
      const auto in_box = hn::Min(hn::Max(q, hn::Zero(d)), hn::Set(d, grid.nodes[axis] - 2));
      const auto x = hn::DemoteTo(c, in_box);
      at = hn::Add(at, hn::Mul(hn::ShiftRight<2>(x), hn::Set(c, brick[axis])));
      at = hn::Add(at, hn::Mul(hn::And(x, hn::Set(c, 3)), hn::Set(c, within[axis])));
    }
    hn::StoreU(at, c, index + i);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace geocage::geometry
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace geocage::geometry {

HWY_EXPORT(MarksAlong);

void marks_along(const GridSize& grid, const double* a, const double* ab, int last, int* index) {
  HWY_DYNAMIC_DISPATCH(MarksAlong)(grid, a, ab, last, index);
}

}  // namespace geocage::geometry
#endif
