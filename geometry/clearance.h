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

/// Squared distance, in cells, of every cell of a grid (x fastest) to the nearest chosen one; infinite when
/// none is.
std::vector<double> squared_distances(const std::array<int, 3>& size, const std::vector<bool>& chosen);

}  // namespace geocage::geometry
