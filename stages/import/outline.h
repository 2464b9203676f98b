#pragma once
#include <vector>

#include "geometry/pose.h"

namespace geocage::stages {

/// The convex hull of points' feet on a plane.
class Outline {
 public:
  Outline(const geometry::Plane& plane, const std::vector<geometry::Vec3>& points);
  /// Whether the foot of p lies in it, or within `margin_m` of each of its sides' lines.
  bool holds(const geometry::Vec3& p, double margin_m = 0) const;

 private:
  using Point2 = Eigen::Vector2d;
  Point2 foot(const geometry::Vec3& p) const { return {frame_.col(0).dot(p), frame_.col(1).dot(p)}; }
  Eigen::Matrix3d frame_;
  std::vector<Point2> corners_;  ///< counter-clockwise
};

}  // namespace geocage::stages
