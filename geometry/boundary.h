#pragma once
#include "geometry/mesh.h"

namespace geocage::geometry {

/// How many rims an open mesh has: edges of one triangle only, those that hang together by vertices counted
/// once. Precondition: its triangles name vertices that are there.
int boundary_loops(const TriangleMesh& mesh);

}  // namespace geocage::geometry
