#pragma once
#include <cstdint>

#include "topology/ball_rows.h"

// Principal axes of many balls at once, from their sums; compiled for several instruction sets like
// ball_rows.h, with the same bytes from each.

namespace geocage::topology {

/// Of each lane: the mean of its vertices about the sums' origin, and the unit principal axis.
struct LaneAxes {
  alignas(64) double mean[3][lanes], axis[3][lanes];
  enum State : std::uint8_t { none, dominant, unsure };  ///< unsure: two eigenvalues are nearly the same
  State state[lanes];
};

/// For the first `count` lanes, `sums` being rows of `sum_slots`. An axis is dominant when its eigenvalue is
/// at least `guard` times the next. The largest root of the characteristic polynomial by Newton's method; the
/// vector is the longest cross product of two rows of S - l1 I.
void principal_axes(const double* sums, int count, double guard, LaneAxes& axes);

}  // namespace geocage::topology
