#include "motion/mover.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace geocage::motion {

using Eigen::VectorXd;

Mover::Mover(const hands::Hand& hand, const Pose& X_OH, int base_dofs)
    : hand_(hand), goal_(X_OH), base_dofs_(base_dofs) {
  for (std::size_t c = 0; c < hand_.capsules.size(); ++c) {
    const hands::Capsule& capsule = hand_.capsules[c];
    const Vec3 along = capsule.b_L - capsule.a_L;
    const int count = 1 + static_cast<int>(std::ceil(along.norm() / capsule.radius_m));
    for (int i = 0; i < count; ++i)
      balls_.push_back({static_cast<int>(c), capsule.link,
                        capsule.a_L + along * (count > 1 ? double(i) / (count - 1) : 0), capsule.radius_m});
  }
  for (std::size_t begin = 0, end = 0; begin < balls_.size(); begin = end) {
    Vec3 low = balls_[begin].p_L, high = low;
    for (end = begin; end < balls_.size() && balls_[end].link == balls_[begin].link; ++end) {
      low = low.cwiseMin(balls_[end].p_L);
      high = high.cwiseMax(balls_[end].p_L);
    }
    Group group{begin, end, (low + high) / 2, 0};
    for (std::size_t i = begin; i < end; ++i)
      group.radius_m = std::max(group.radius_m, (balls_[i].p_L - group.p_L).norm() + balls_[i].radius_m);
    groups_.push_back(group);
  }
}

VectorXd Mover::state(const Pose& X_OH, const VectorXd& q) const {
  if (!floats()) return q;
  VectorXd x(dim());
  x << (X_OH.translation() - goal_.translation()) / unit_m,
      logarithm(X_OH.linear() * goal_.linear().transpose()), q;
  return x;
}

Pose Mover::pose(const VectorXd& x) const {
  Pose X_OH = goal_;
  if (!floats()) return X_OH;
  X_OH.translation() += unit_m * x.head<3>();
  X_OH.linear() = exponential(x.segment<3>(3)) * goal_.linear();
  return X_OH;
}

VectorXd Mover::lower() const {
  VectorXd bound = VectorXd::Constant(dim(), -std::numeric_limits<double>::infinity());
  bound.tail(hand_.tree.dofs()) = hand_.tree.lower_rad;
  return bound;
}

VectorXd Mover::upper() const {
  VectorXd bound = VectorXd::Constant(dim(), std::numeric_limits<double>::infinity());
  bound.tail(hand_.tree.dofs()) = hand_.tree.upper_rad;
  return bound;
}

void Mover::place(const VectorXd& x, Placed& placed) const {
  if (placed.x.size() == x.size() && placed.x == x) return;
  placed.x = x;
  placed.q = joints(x);
  hands::forward_kinematics(hand_.tree, placed.q, placed.X_HL);
  placed.X_OH = pose(x);
  if (floats()) placed.turning = left_jacobian(x.segment<3>(3));
  placed.X_OL.resize(placed.X_HL.size());
  for (std::size_t i = 0; i < placed.X_HL.size(); ++i) placed.X_OL[i] = placed.X_OH * placed.X_HL[i];
}

}  // namespace geocage::motion
