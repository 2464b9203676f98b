#pragma once
#include <algorithm>
#include <cmath>
#include <map>
#include <vector>

#include <Eigen/Eigenvalues>

#include "geometry/median.h"
#include "geometry/pose.h"

namespace geocage::tests {

/// What a scanned plane says of its sensor: the measures by which real scans were judged.
struct PlaneNoise {
  double local_rms_m;    ///< median over squares of 5 cm of the residual of a plane fitted to each
  double whole_rms_m;    ///< residual of one plane fitted to all points
  double spacing_m;      ///< median distance to the nearest other point
  double spacing_rad;    ///< median of that distance over the depth
  double incidence_rad;  ///< between the plane's normal and z of the points' frame
};

using Points = std::vector<geometry::Vec3>;

inline geometry::Plane fitted_plane(const Points& points) {
  geometry::Vec3 mean = geometry::Vec3::Zero();
  for (const auto& p : points) mean += p;
  mean /= static_cast<double>(points.size());
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const auto& p : points) scatter += (p - mean) * (p - mean).transpose();
  const geometry::Vec3 normal = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(scatter).eigenvectors().col(0);
  return {normal, normal.dot(mean)};
}

inline double residual_rms(const Points& points) {
  const auto plane = fitted_plane(points);
  double sum = 0;
  for (const auto& p : points) sum += plane.height_m(p) * plane.height_m(p);
  return std::sqrt(sum / static_cast<double>(points.size()));
}

inline PlaneNoise plane_noise(const Points& points) {
  const auto plane = fitted_plane(points);
  const Eigen::Matrix3d frame = geometry::frame_from_z(plane.normal);
  std::map<std::pair<long, long>, Points> squares;
  for (const auto& p : points)
    squares[{std::lround(frame.col(0).dot(p) / 0.05), std::lround(frame.col(1).dot(p) / 0.05)}].push_back(p);
  std::vector<double> local, nearest, angle;
  for (const auto& [square, inside] : squares) {
    if (inside.size() < 200) continue;
    local.push_back(residual_rms(inside));
    for (std::size_t i = 0; i < inside.size();
         i += 97) {  // neighbours across the border are missed: rarely nearest
      double best = 1;
      for (std::size_t j = 0; j < inside.size(); ++j)
        if (j != i) best = std::min(best, (inside[i] - inside[j]).norm());
      nearest.push_back(best);
      angle.push_back(best / std::abs(inside[i].z()));
    }
  }
  return {geometry::median(local), residual_rms(points), geometry::median(nearest), geometry::median(angle),
          std::acos(std::abs(plane.normal.z()))};
}

}  // namespace geocage::tests
