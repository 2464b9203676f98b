#pragma once
#include "motion/problem.h"
#include "motion/tasks/chain.h"

namespace geocage::motion {

/// Signed turns of the chain around `center` in the plane with the unit `normal` (thesis 3.2): one error.
Task winding_task(const MovingChain& chain, const topology::Vec3& center, const topology::Vec3& normal,
                  const TargetOf& target, std::vector<double> precision);

/// Fingers wrap as they come: the turns of each about the middle of all fingers' points in `closed`, in the
/// plane that its own points lie in there, go from those in `start` to those in `closed` in `horizon` even
/// steps. A finger that is straight in `closed` has no plane and no task. The mover must outlive the tasks.
std::vector<Task> wrapping_tasks(const Mover& mover, const Eigen::VectorXd& start,
                                 const Eigen::VectorXd& closed, int horizon, double precision);

}  // namespace geocage::motion
