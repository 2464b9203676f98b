#pragma once
#include <cstdint>

#include "geometry/cloud.h"

namespace geocage::stages {

/// Turns normals so that neighbours agree (minimum spanning tree, Hoppe et al. 1992, sect. 3.3, by CGAL) and
/// the cloud's uppermost point faces up. For clouds whose sensors are not known.
void orient_by_propagation(geometry::PointCloud& cloud, int neighbours, std::uint64_t seed);

}  // namespace geocage::stages
