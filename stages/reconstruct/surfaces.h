#pragma once
#include <cstdint>

#include "geometry/cloud.h"
#include "geometry/mesh.h"

namespace geocage::stages {

/// pcl::Poisson (Kazhdan et al. 2006) with one thread; normals must be consistent.
geometry::TriangleMesh poisson_surface(const geometry::PointCloud& cloud, int depth, double samples_per_node);

/// Fills border loops of at most `most_edges` edges (Liepa 2003, by CGAL), such as PCL's extraction leaves
/// where octree levels meet; answers how many.
int fill_holes(geometry::TriangleMesh& mesh, int most_edges);

/// CGAL's alpha_wrap_3 (Portaneri et al. 2022): closed and manifold whatever the points are, but outside them
/// by `offset_m`.
geometry::TriangleMesh wrapped_surface(const geometry::PointCloud& cloud, double alpha_m, double offset_m,
                                       std::uint64_t seed);

}  // namespace geocage::stages
