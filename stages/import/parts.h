#pragma once
#include <vector>

#include "geometry/cloud.h"

namespace geocage::stages {

struct PartRule {
  double patch_m;        ///< size of the patches that are compared
  double concavity_deg;  ///< neighbours that meet at a hollower angle belong to different objects
  int points;            ///< a part with fewer points belongs to the neighbour that it touches most
};

/// Objects that touch: the points of one cluster parted where they meet in a hollow crease, as two things
/// that touch do. Almost flat patches become parts by a multicut (multicut.h) of the borders between them,
/// and parts that are pieces of one thing are joined again (part_joins.h). Clusters lower than 4.5 cm are one
/// object. Indices ascending. Precondition: one sensor, whose place is known: it tells which way a patch
/// faces, and which places are empty.
std::vector<std::vector<int>> parts_by_shape(const geometry::PointCloud& cloud,
                                             const std::vector<int>& cluster, const geometry::Plane& table,
                                             const PartRule& rule);

}  // namespace geocage::stages
