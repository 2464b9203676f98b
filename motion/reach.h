#pragma once
#include <cstdint>
#include <optional>

#include "hands/arm.h"
#include "motion/certificate.h"

namespace geocage::motion {

struct ReachRule {
  int tries = 12;  ///< postures to start from: the arm's rest, then random ones
  double position_m = 1e-5, rotation_rad = 1e-4;  ///< how near counts as reached
  double margin_m = 0.01;                         ///< of the arm from obstacles, wished for
  double tolerance_m = 5e-4;                      ///< the open hand's
  std::uint64_t seed = 1;
};

enum class Reach { reached, out_of_reach, blocked };

struct ReachAnswer {
  Reach outcome = Reach::out_of_reach;
  Eigen::VectorXd x;  ///< all joints; the nearest that was found when out of reach
  double miss_m = 0, miss_rad = 0;
};

/// A posture of the arm that brings the hand's base to `X_OH` with the hand's joints at `hand_rad`: final
/// posture estimation with tasks of position, rotation, limits and clearance around the arm's rest, from
/// several starts. The first that is reached within limits and free wins; `blocked` when some are reached and
/// none is free.
ReachAnswer reach(const Mover& mover, const hands::ArmedHand& armed, Prover& prover,
                  const Obstacles& obstacles, const Pose& X_OH, const Eigen::VectorXd& hand_rad,
                  const ReachRule& rule = {}, const Eigen::VectorXd* near = nullptr);

}  // namespace geocage::motion
