#pragma once
#include <memory>
#include <utility>
#include <vector>

#include "motion/mover.h"
#include "motion/problem.h"

namespace geocage::motion {

/// Nearest points of two segments, p = a + s (b - a) on the first, q = c + t (d - c) on the second, and |p -
/// q|.
struct SegmentGap {
  double s = 0, t = 0, distance_m = 0;
};
/// Exact, also for segments that are parallel or points (Ericson 2005, 5.1.9).
SegmentGap segment_gap(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d);

/// Pairs of capsules that may run into each other: of links that are neither the same nor neighbours (joints
/// of no length between them count as none), and that are apart at the posture q.
std::vector<std::pair<int, int>> self_pairs(const hands::Hand& body, const Eigen::VectorXd& q);

/// Self-collision potential: a hinge on each pair that is nearer than margin_m, e = max(0, 1 - d / margin).
/// The mover must outlive the task.
Task self_clearance_task(const Mover& mover, std::vector<std::pair<int, int>> pairs, double margin_m,
                         std::vector<double> precision,
                         std::shared_ptr<Mover::Placed> placed = std::make_shared<Mover::Placed>());

}  // namespace geocage::motion
