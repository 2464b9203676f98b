#pragma once
#include <cstdint>
#include <vector>

#include "geometry/cloud.h"

namespace geocage::stages {

/// A plane and the points on it.
struct FoundPlane {
  geometry::Plane plane;  ///< normal towards the sensor
  std::vector<int> on;    ///< indices, ascending
};

/// The plane with the most points within `tolerance_m` (RANSAC with a fixed seed, then least squares); no
/// points on it when there is none.
FoundPlane find_plane(const geometry::PointCloud& cloud, double tolerance_m, std::uint64_t seed);

/// What stands on the plane: points between the heights whose foot lies inside the convex hull of the plane's
/// points. Indices ascending.
std::vector<int> standing_on(const geometry::PointCloud& cloud, const FoundPlane& table, double above_min_m,
                             double above_max_m);

/// What a table is looked for by: heights between which things on it begin and end, the least points of one.
struct TableRule {
  double plane_tolerance_m, above_min_m, above_max_m;
  int points;
  std::uint64_t seed;
};

/// A table and what stands on it, indices ascending.
struct FoundTable {
  FoundPlane table;
  std::vector<int> standing;
  bool in_room = false;
};

/// The table in a room (room.h), or else the plane with the most points and what stands on it.
FoundTable find_table(const geometry::PointCloud& cloud, const TableRule& rule);

/// Euclidean clusters of the chosen points (farther from each other than `gap_m`, hanging together by steps
/// of at most that) with at least `points` of them, the largest first. Indices ascending.
std::vector<std::vector<int>> clusters_of(const geometry::PointCloud& cloud, const std::vector<int>& chosen,
                                          double gap_m, int points);

}  // namespace geocage::stages
