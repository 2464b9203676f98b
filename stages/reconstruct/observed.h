#pragma once
#include <vector>

#include "geometry/cloud.h"
#include "geometry/mesh.h"

namespace geocage::stages {

/// For each vertex how far it was observed: the largest product f(d) g(n . n_i) over the eight measured
/// points i nearest to it. f is 1 up to the distance `near_m` and falls to 0 at twice that; g is 1 where the
/// normals agree to 90 degrees and falls to 0 at 120, so that the back of a thin wall is not taken for its
/// front. Both fall as 3 s^2 - 2 s^3. O(V log N).
std::vector<double> observed_of(const geometry::TriangleMesh& mesh, const geometry::PointCloud& cloud,
                                double near_m);

/// Mean distance of points to their six nearest ones, of 2000 points spread over the cloud.
double mean_spacing_m(const geometry::PointCloud& cloud);

}  // namespace geocage::stages
