#pragma once
#include <cstdint>

#include "geometry/cloud.h"
#include "geometry/mesh.h"

// Surfaces through oriented points, as the libraries give them: maybe open, in several parts or not manifold.
// Call them in a worker process: PCL's keeps global state, CGAL's may end the program on odd points.
namespace geocage::stages {

/// pcl::Poisson (Kazhdan et al. 2006) with one thread; normals must be consistent.
geometry::TriangleMesh poisson_surface(const geometry::PointCloud& cloud, int depth, double samples_per_node);

/// CGAL's Poisson reconstruction (Kazhdan et al. 2006 on a Delaunay refinement, meshed after Boissonnat and
/// Oudot 2005) with triangles about 3 `spacing_m` wide, the points' mean distance. The mesher's handles are
/// ordered by when they were made; the function below it still orders some of its own by address.
geometry::TriangleMesh cgal_poisson_surface(const geometry::PointCloud& cloud, double spacing_m,
                                            std::uint64_t seed);

/// CGAL's advancing front (Cohen-Steiner and Da 2004): triangles of the points' Delaunay triangulation, so
/// noise stays as it is; open where points are missing.
geometry::TriangleMesh advancing_front_surface(const geometry::PointCloud& cloud, std::uint64_t seed);

}  // namespace geocage::stages
