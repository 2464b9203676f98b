#pragma once
#include "motion/problem.h"
#include "motion/tasks/chain.h"

namespace geocage::motion {

enum class WritheForm {
  scalar,  ///< Gauss linking integral, the sum over 4 pi: 1 error
  sums,    ///< w_j = sum_i Omega_ij [sr] for each segment of the fixed chain
  matrix,  ///< Omega_ij [sr], the moving chain's segments one after the other
};

/// How the moving chain winds round a fixed one (thesis 3.1). Where they touch it jumps: add a clearance
/// task.
Task writhe_task(const MovingChain& chain, const topology::Polyline& fixed, WritheForm form,
                 const TargetOf& target, std::vector<double> precision);

}  // namespace geocage::motion
