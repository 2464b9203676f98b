#pragma once
#include <vector>

#include "geometry/cloud.h"

namespace geocage::stages {

struct PartRule {
  double patch_m;        ///< size of the patches that are compared
  double concavity_deg;  ///< neighbours that meet at a hollower angle belong to different objects
  int points;            ///< a part with fewer points belongs to the neighbour that it touches most
};

/// Objects that touch: the points of one cluster parted where patches meet at a hollow angle, as two convex
/// things that touch do (locally convex connected patches, Stein et al. 2014, by PCL). What most of whose
/// points lie within the convex hull of a neighbour is one object with it, as the inside of a cup is, and so
/// is what neither stands on the table nor rests on a neighbour, and what stands where a neighbour does.
/// Clusters lower than 4.5 cm are one object. Indices ascending. Precondition: one sensor, whose place is
/// known: it tells which way a patch faces.
std::vector<std::vector<int>> convex_parts(const geometry::PointCloud& cloud, const std::vector<int>& cluster,
                                           const geometry::Plane& table, const PartRule& rule);

}  // namespace geocage::stages
