#include "stages/import/table.h"

#include <algorithm>
#include <random>

#include <Eigen/Eigenvalues>

#include "geometry/clusters.h"
#include "stages/import/outline.h"
#include "stages/import/room.h"

namespace geocage::stages {

using geometry::Plane;
using geometry::PointCloud;
using geometry::Vec3;

namespace {

int count_on(const PointCloud& cloud, const Plane& plane, double tolerance_m, std::size_t stride) {
  int count = 0;
  for (std::size_t i = 0; i < cloud.size(); i += stride)
    count += std::abs(plane.height_m(cloud.points[i])) <= tolerance_m;
  return count;
}

std::vector<int> points_on(const PointCloud& cloud, const Plane& plane, double tolerance_m) {
  std::vector<int> on;
  for (std::size_t i = 0; i < cloud.size(); ++i)
    if (std::abs(plane.height_m(cloud.points[i])) <= tolerance_m) on.push_back(static_cast<int>(i));
  return on;
}

Plane least_squares(const PointCloud& cloud, const std::vector<int>& on) {
  Vec3 mean = Vec3::Zero();
  for (int i : on) mean += cloud.points[i];
  mean /= static_cast<double>(on.size());
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (int i : on) scatter += (cloud.points[i] - mean) * (cloud.points[i] - mean).transpose();
  const Vec3 normal = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(scatter).eigenvectors().col(0);
  return {normal, normal.dot(mean)};
}

}  // namespace

FoundPlane find_plane(const PointCloud& cloud, double tolerance_m, std::uint64_t seed) {
  FoundPlane found;
  std::mt19937_64 random(seed);
  const std::size_t stride = std::max<std::size_t>(1, cloud.size() / 20000);
  Plane best;
  int most = 0;
  for (int i = 0; i < 500; ++i) {
    const Vec3 &a = cloud.points[random() % cloud.size()], &b = cloud.points[random() % cloud.size()],
               &c = cloud.points[random() % cloud.size()];
    const Vec3 normal = (b - a).cross(c - a);
    if (normal.norm() < 1e-9) continue;
    const Plane plane{normal.normalized(), normal.normalized().dot(a)};
    const int count = count_on(cloud, plane, tolerance_m, stride);
    if (count > most) {
      most = count;
      best = plane;
    }
  }
  if (most < 3) return found;
  // To a plane that its own points give back, so that the draws above leave no trace.
  for (int i = 0; i < 50; ++i) {
    auto on = points_on(cloud, best, tolerance_m);
    if (on == found.on) break;
    best = least_squares(cloud, on);
    found.on = std::move(on);
  }
  const Vec3 sensor = cloud.sensor_origins.empty() ? Vec3::Zero().eval() : cloud.sensor_origins.front();
  if (best.height_m(sensor) < 0) best = {-best.normal, -best.offset_m};
  found.plane = best;
  found.on = points_on(cloud, best, tolerance_m);
  return found;
}

std::vector<int> standing_on(const PointCloud& cloud, const FoundPlane& table, double above_min_m,
                             double above_max_m) {
  std::vector<Vec3> on;
  for (int i : table.on) on.push_back(cloud.points[i]);
  const Outline outline(table.plane, on);
  std::vector<int> standing;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const Vec3& p = cloud.points[i];
    const double height = table.plane.height_m(p);
    if (height >= above_min_m && height <= above_max_m && outline.holds(p))
      standing.push_back(static_cast<int>(i));
  }
  return standing;
}

FoundTable find_table(const PointCloud& cloud, const TableRule& rule) {
  FoundTable found{find_plane(cloud, rule.plane_tolerance_m, rule.seed), {}};
  if (found.table.on.empty()) return found;
  if (auto in_room = table_in_room(cloud, found.table, rule)) return *in_room;
  found.standing = standing_on(cloud, found.table, rule.above_min_m, rule.above_max_m);
  return found;
}

std::vector<std::vector<int>> clusters_of(const PointCloud& cloud, const std::vector<int>& chosen,
                                          double gap_m, int min_points) {
  std::vector<Vec3> points;
  for (int i : chosen) points.push_back(cloud.points[i]);
  auto clusters = geometry::clusters(points, gap_m);
  std::erase_if(clusters, [&](const auto& one) { return static_cast<int>(one.size()) < min_points; });
  for (auto& cluster : clusters)
    for (int& i : cluster) i = chosen[i];
  std::sort(clusters.begin(), clusters.end(),
            [](const auto& a, const auto& b) { return a.size() != b.size() ? a.size() > b.size() : a < b; });
  return clusters;
}

}  // namespace geocage::stages
