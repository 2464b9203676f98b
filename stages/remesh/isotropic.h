#pragma once
#include <functional>

#include "geometry/mesh.h"

namespace geocage::stages {

/// Near-equilateral triangles with `vertices` vertices on the surface of `mesh`: `sweeps` rounds of split,
/// collapse, flip, smooth and project (Botsch and Kobbelt 2004, "A remeshing approach to multiresolution
/// modeling"), then the exact count, and smoothing with all angles lifted above 33 degrees where the shape
/// allows. Folds of more than 60 degrees move along themselves only, so thin rims stay. One thread, the same
/// bytes whatever the order of vertices and triangles. Precondition: every edge in two triangles, oriented
/// alike, no triangle without area; a vertex with several fans is parted. The Euler number is that of the
/// parted input. The count may be missed where a smaller one would change the genus; triangles may still cut
/// each other where walls are thinner than an edge is long: check both. `progress(done, total)` is called
/// between rounds. O(sweeps (F + V log F)).
geometry::TriangleMesh isotropic(const geometry::TriangleMesh& mesh, int vertices, int sweeps,
                                 const std::function<void(std::size_t, std::size_t)>& progress = {});

}  // namespace geocage::stages
