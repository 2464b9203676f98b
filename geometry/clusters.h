#pragma once
#include <vector>

#include "geometry/pose.h"

namespace geocage::geometry {

/// Single linkage: points belong together that hang together by steps of at most `gap`. Clusters in the order
/// of their first points, indices ascending. The Delaunay triangulation holds a shortest spanning tree, so
/// its edges of at most `gap` join what all pairs would: about n log n, where a search for neighbours gives
/// each of n points all that lie within the gap. Points finite.
std::vector<std::vector<int>> clusters(const std::vector<Vec3>& points, double gap);

}  // namespace geocage::geometry
