#pragma once
#include "geometry/distance_field.h"
#include "geometry/occupancy.h"

namespace geocage::geometry {

struct ClearanceRule {
  bool unknown_is_solid = false;  ///< what no ray has passed may hide something
  double pad_m = 0.05;            ///< border of the grid around the occupied cells
};

/// Distance to what a map holds, for planning: positive in the open, negative within solid cells, with a
/// value and a gradient anywhere (SignedDistanceField::value). Nodes are the centres of the map's cells;
/// their value is the distance to the nearest centre of the other kind less half a cell, so that it is 0 on
/// the cells' faces: exact in front of a face, too large by at most 0.37 cells towards edges and corners.
/// Outside the grid it counts the unknown as open, whatever the rule says: pad enough. Exact Euclidean
/// transform (Felzenszwalb and Huttenlocher 2012), O(cells). Errors: UserError (geometry) when nothing is
/// occupied or the grid had more than 2^26 cells.
SignedDistanceField clearance_field(const Occupancy& map, const ClearanceRule& rule);

/// What of a map is the object's or its support's own, and what lies there by chance.
struct OwnRule {
  double near_cells = 1.5;      ///< cells are the object's up to so many sides from its surface
  double noise_deviations = 4;  ///< and up to so many standard deviations of the seen points further
  double noise_reach_m = 0.03;  ///< points further from the surface than this are no measure of that
  int least_cells = 4;          ///< smaller groups of neighbouring cells (26 of them) are stray
};

/// Which cells of a map are in the way of a hand that comes to the object.
struct Others {
  std::vector<Vec3> centers_O;  ///< occupied, and neither the object's nor the support's nor stray
  std::size_t of_object = 0, of_support = 0, stray = 0;  ///< cells that were left out, and why
  double deviation_m = 0;  ///< of the seen points from the surface, by the median distance
  double band_m = 0;       ///< cells up to here count as the object's, or the support's
};

/// Occupied cells besides object and support. Noise of a sensor leaves cells off the surface: how far is told
/// by the points of the cloud near it. None of a map without a tree. O(cells + points).
Others other_cells(const Occupancy& map, const SignedDistanceField& object, const PointCloud& cloud,
                   const OwnRule& rule);

/// The same clearance to `others` only, and, if the rule says so, to unknown cells beyond the object's and
/// the support's band. Without any of them a field without nodes.
SignedDistanceField clearance_of_others(const Occupancy& map, const Others& others,
                                        const SignedDistanceField& object, const PointCloud& cloud,
                                        const ClearanceRule& rule);

/// Squared distance, in cells, of every cell of a grid (x fastest) to the nearest chosen one; infinite when
/// none is.
std::vector<double> squared_distances(const std::array<int, 3>& size, const std::vector<bool>& chosen);

}  // namespace geocage::geometry
