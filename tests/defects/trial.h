#pragma once
#include <string>

#include "geometry/repair.h"
#include "tests/defects/mutators.h"

namespace geocage::tests {

/// What happened to one broken mesh.
struct Trial {
  std::string mutator, outcome, reason;
  std::uint64_t seed = 0;
  double seconds = 0, moved = 0;  ///< larger one-sided distance, in diagonals of the whole mesh
  bool good = false;              ///< rejected with a reason, or CGAL finds nothing wrong with the answer
};

/// Breaks a closed mesh and repairs it as import does: repair, then the guard of units.
Trial try_defect(const Mutator& mutator, geometry::TriangleMesh mesh, std::uint64_t seed,
                 const geometry::RepairParams& params);

}  // namespace geocage::tests
