#pragma once
#include "motion/problem.h"
#include "motion/tasks/chain.h"

namespace geocage::motion {

/// Signed turns of the chain around `center` in the plane with the unit `normal` (thesis 3.2): one error.
Task winding_task(const MovingChain& chain, const topology::Vec3& center, const topology::Vec3& normal,
                  const TargetOf& target, std::vector<double> precision);

}  // namespace geocage::motion
