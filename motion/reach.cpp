#include "motion/reach.h"

#include <cmath>
#include <random>

#include "motion/posture.h"
#include "motion/tasks/frame.h"
#include "motion/tasks/limits.h"
#include "motion/tasks/state.h"

namespace geocage::motion {

using Eigen::VectorXd;

ReachAnswer reach(const Mover& mover, const hands::ArmedHand& armed, Prover& prover,
                  const Obstacles& obstacles, const Pose& X_OH, const VectorXd& hand_rad,
                  const ReachRule& rule, const VectorXd* near) {
  const Eigen::Index arm = armed.arm_dofs;
  const VectorXd lower = mover.lower(), upper = mover.upper();
  VectorXd rest = armed.body.open_rad;
  rest.tail(hand_rad.size()) = hand_rad;
  if (near) rest.head(arm) = near->head(arm);
  const LinkFrame base{armed.hand_link, Vec3::Zero(), Matrix3d::Identity()};
  const std::vector<double> firm = {0, 1e8};  // tenths of a millimetre against a radian of the rest posture
  const Vec3 p_O = X_OH.translation();
  Matrix3d R_O = X_OH.linear();
  std::vector<Task> tasks = {position_task(mover, base, constant_target(p_O), firm),
                             orientation_task(mover, base, [R_O](int) { return R_O; }, {0, 1e6}),
                             limits_task(lower + VectorXd::Constant(lower.size(), 1e-3),
                                         upper - VectorXd::Constant(upper.size(), 1e-3), {0, 1e6}),
                             posture_task(hand_rad, arm, {0, 1e8}),
                             clearance_task(mover, obstacles, {rule.margin_m, rule.margin_m}, {0, 1e-1})};
  const EndPrior prior{rest, 10 * Eigen::MatrixXd::Identity(rest.size(), rest.size()),
                       VectorXd::Zero(rest.size()), Eigen::MatrixXd::Zero(rest.size(), rest.size())};
  std::mt19937_64 engine(rule.seed);
  ReachAnswer best;
  best.miss_m = best.miss_rad = 1e9;
  Mover::Placed placed;
  for (int k = 0; k < rule.tries; ++k) {
    VectorXd first = rest;
    if (k > 0)
      for (Eigen::Index i = 0; i < arm; ++i) {
        const double share = static_cast<double>(engine() >> 11) * 0x1p-53;
        first[i] = lower[i] + (0.1 + 0.8 * share) * (upper[i] - lower[i]);
      }
    VectorXd x =
        final_posture(prior, tasks, 1, first,
                      {.max_steps = 60, .max_step = 0.7, .cost_tolerance = 1e-9, .step_tolerance = 1e-7})
            .mean;
    x.tail(hand_rad.size()) = hand_rad;
    mover.place(x, placed);
    const Pose& X = placed.X_OL[static_cast<std::size_t>(armed.hand_link)];
    const double miss_m = (X.translation() - p_O).norm(),
                 miss_rad = logarithm(X.linear() * R_O.transpose()).norm();
    const bool near_enough = miss_m < rule.position_m && miss_rad < rule.rotation_rad &&
                             ((x - upper).array() <= 0).all() && ((lower - x).array() <= 0).all();
    if (near_enough && prover.posture_free(x, -rule.tolerance_m))
      return {Reach::reached, x, miss_m, miss_rad};
    if (near_enough) best.outcome = Reach::blocked;
    if (miss_m + miss_rad < best.miss_m + best.miss_rad) {
      best.x = x;
      best.miss_m = miss_m;
      best.miss_rad = miss_rad;
    }
  }
  return best;
}

}  // namespace geocage::motion
