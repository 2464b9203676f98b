#pragma once
#include <vector>

#include "geometry/cloud.h"

namespace geocage::stages {

/// A surface of revolution about an upright axis, as cans, bottles, bowls and mugs are.
struct Turned {
  Eigen::Vector2d axis_m;  ///< where it meets the table, along the first two columns of frame_from_z(normal)
  double off_m;            ///< deviation of the points' distances to the axis from their mean at each height
};

/// The axis about which points seen from the origin turn best: Gauss-Newton, from 3 cm behind their middle;
/// 600 of them at most, heights in slices of 6 mm. Precondition: at least one point.
Turned turned_about(const std::vector<geometry::Vec3>& seen, const geometry::Plane& table);

}  // namespace geocage::stages
