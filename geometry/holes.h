#pragma once
#include "geometry/mesh.h"

namespace geocage::geometry {

/// Fills border loops of at most `most_edges` sides with triangles of little area (Liepa 2003, by CGAL), or
/// with a fan around the loop's middle where those would repeat a side that is there already; answers how
/// many. Precondition: a 2-manifold with borders, oriented alike. May take long for loops of thousands of
/// sides: call it in a worker process.
int fill_holes(TriangleMesh& mesh, int most_edges);

}  // namespace geocage::geometry
