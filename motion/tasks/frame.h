#pragma once
#include "motion/mover.h"
#include "motion/problem.h"
#include "motion/tasks/target.h"

namespace geocage::motion {

/// A point fixed in a link at p_L, or a frame there that is turned by R_L.
struct LinkFrame {
  int link = 0;
  Vec3 p_L = Vec3::Zero();
  Matrix3d R_L = Matrix3d::Identity();
};

// The mover must outlive its tasks; a task is for one thread at a time.

/// Position of a point [m in O], three errors.
Task position_task(const Mover& mover, const LinkFrame& point, const TargetOf& p_O,
                   std::vector<double> precision);

/// Rotation of a frame: e = log(R_OF R*'), the rotation vector [rad in O] from the target; three errors.
/// Singular at half a turn from it. `R_O` is the target at each step.
Task orientation_task(const Mover& mover, const LinkFrame& frame, const std::function<Matrix3d(int t)>& R_O,
                      std::vector<double> precision);

/// A direction of a link along another in O: e = R_OL axis_L - d_O, both unit vectors; three errors.
Task alignment_task(const Mover& mover, int link, const Vec3& axis_L, const Vec3& direction_O,
                    std::vector<double> precision);

/// Pose of frame B in frame A, both fixed in links of the mover: e = (p_AB - p*, log(R_AB R*')), metres and
/// radians; six errors.
Task relative_pose_task(const Mover& mover, const LinkFrame& A, const LinkFrame& B,
                        const std::function<Pose(int t)>& X_AB, std::vector<double> precision);

}  // namespace geocage::motion
