#pragma once
#include "geometry/mesh.h"

namespace geocage::stages {

/// What was cut.
struct CutHandles {
  int handles = 0;     ///< so much smaller is the genus
  double moved_m = 0;  ///< no point of the old or new surface there is farther from the other: half a loop
};

/// Cuts handles off that a loop of less than `loop_m` goes round, and stops holes up whose rim is shorter:
/// the shortest such loops of topology/loops.h that keep clear of each other are cut out with the triangles
/// that they cross, and both their sides are filled (after Guskov and Wood 2001, "Topological noise
/// removal"). Again until none is left. A cut whose filling would not be a solid (geometry/repair.h) is not
/// made. `observed` is dropped. Precondition: a solid. O(genus) searches at most.
CutHandles cut_small_handles(geometry::TriangleMesh& mesh, double loop_m);

}  // namespace geocage::stages
