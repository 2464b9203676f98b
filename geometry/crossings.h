#pragma once
#include <cstddef>
#include <limits>
#include <utility>
#include <vector>

#include "geometry/mesh.h"

namespace geocage::geometry {

/// Pairs of triangles (i < j, ascending) that meet in more than the corners or the side that they share, and
/// (i, i) for triangles whose corners lie on a line. Exact predicates on the given doubles; the criterion is
/// that of CGAL's `does_self_intersect`. Stops after `most` pairs. Precondition: valid indices, finite
/// vertices. O(F log F + pairs of boxes that meet).
std::vector<std::pair<int, int>> crossing_triangles(
    const TriangleMesh& mesh, std::size_t most = std::numeric_limits<std::size_t>::max());

}  // namespace geocage::geometry
