#include "stages/import/outline.h"

#include <algorithm>

namespace geocage::stages {

using geometry::Vec3;
using Point2 = Eigen::Vector2d;

namespace {

double turn(const Point2& a, const Point2& b, const Point2& c) {
  return (b - a).x() * (c - a).y() - (b - a).y() * (c - a).x();
}

/// Andrew's monotone chain.
std::vector<Point2> convex_hull(std::vector<Point2> points) {
  std::sort(points.begin(), points.end(), [](const Point2& a, const Point2& b) {
    return std::pair(a.x(), a.y()) < std::pair(b.x(), b.y());
  });
  std::vector<Point2> hull;
  for (int pass = 0; pass < 2; ++pass) {
    const std::size_t base = hull.size();
    for (const Point2& p : points) {
      while (hull.size() >= base + 2 && turn(hull[hull.size() - 2], hull.back(), p) <= 0) hull.pop_back();
      hull.push_back(p);
    }
    if (!hull.empty()) hull.pop_back();
    std::reverse(points.begin(), points.end());
  }
  return hull;
}

}  // namespace

Outline::Outline(const geometry::Plane& plane, const std::vector<Vec3>& points)
    : frame_(geometry::frame_from_z(plane.normal)) {
  std::vector<Point2> feet;
  feet.reserve(points.size());
  for (const Vec3& p : points) feet.push_back(foot(p));
  corners_ = convex_hull(std::move(feet));
}

bool Outline::holds(const Vec3& p, double margin_m) const {
  const Point2 at = foot(p);
  for (std::size_t i = 0; i < corners_.size(); ++i) {
    const Point2 &from = corners_[i], &to = corners_[(i + 1) % corners_.size()];
    if (turn(from, to, at) < -margin_m * (to - from).norm()) return false;
  }
  return corners_.size() >= 3;
}

}  // namespace geocage::stages
