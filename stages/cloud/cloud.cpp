#include "stages/cloud/cloud.h"

#include <array>
#include <map>

#include <Eigen/Eigenvalues>
#include <fmt/format.h>
#include <pcl/features/normal_3d.h>
#include <pcl/filters/statistical_outlier_removal.h>
#include <pcl/kdtree/kdtree_flann.h>

#include "geometry/pcl_points.h"
#include "pipeline/error.h"
#include "stages/cloud/orient.h"
#include "stages/cloud/register.h"
#include "stages/cloud/smooth.h"

namespace geocage::stages {

using geometry::PointCloud;
using geometry::Pose;
using geometry::Vec3;

void CloudParams::visit(pipeline::Fields& f) {
  f("registration", registration, {"none", "icp"}, "whether views are moved until they fit each other");
  f("icp_reach_m", icp_reach_m, {1e-4, 1}, "how far apart the views may be")
      .only_with("registration", {"icp"});
  f("icp_rounds", icp_rounds, {1, 1000}, "steps of all views together").only_with("registration", {"icp"});
  f("outlier_neighbours", outlier_neighbours, {2, 1000}, "neighbours whose mean distance tells outliers");
  f("outlier_sigmas", outlier_sigmas, {0.1, 100},
    "a point is dropped when that distance is so many deviations above the mean");
  f("voxel_m", voxel_m, {1e-4, 0.1}, "one point is kept for each voxel of this size");
  f("smooth", smooth, {"none", "mls"}, "moving least squares");
  f("smooth_radius_m", smooth_radius_m, {1e-4, 0.1}, "neighbours lie within this distance")
      .only_with("smooth", {"mls"});
  f("normal_neighbours", normal_neighbours, {4, 1000}, "neighbours that a normal is fitted to");
  f("grazing_deg", grazing_deg, {0, 90}, "points seen at a larger angle of incidence are dropped");
  f("seed", seed, "of the propagation of normals where no sensor is known");
}

namespace {

PointCloud without_outliers(const CloudParams& params, const PointCloud& raw) {
  pcl::StatisticalOutlierRemoval<pcl::PointXYZ> filter;
  filter.setInputCloud(geometry::pcl_points(raw.points, raw.points.front()));
  filter.setMeanK(params.outlier_neighbours);
  filter.setStddevMulThresh(params.outlier_sigmas);
  pcl::Indices kept;
  filter.filter(kept);
  return geometry::subset(raw, kept);
}

/// Mean and principal axes of points, the axes' signs by the third moments: a frame that turns with them.
Pose own_frame(const std::vector<Vec3>& points) {
  const double count = static_cast<double>(points.size());
  Vec3 mean = Vec3::Zero(), skew = Vec3::Zero();
  for (const Vec3& p : points) mean += p / count;
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const Vec3& p : points) scatter += (p - mean) * (p - mean).transpose();
  Eigen::Matrix3d axes = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(scatter).eigenvectors();
  for (const Vec3& p : points) skew += (axes.transpose() * (p - mean)).array().cube().matrix();
  for (int k = 0; k < 2; ++k)
    if (skew[k] < 0) axes.col(k) *= -1;
  axes.col(2) = axes.col(0).cross(axes.col(1));
  Pose frame = Pose::Identity();
  frame.linear() = axes;
  frame.translation() = mean;
  return frame;
}

/// One point for each voxel and view: the mean of those in it. Voxels lie along the cloud's own axes. Views
/// stay apart so that each point keeps its sensor.
PointCloud thinned(const PointCloud& cloud, double voxel_m) {
  const Pose to_own = own_frame(cloud.points).inverse();
  struct Cell {
    Vec3 sum = Vec3::Zero();
    int count = 0;
  };
  std::map<std::array<long, 4>, Cell> cells;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const Vec3 p = to_own * cloud.points[i];
    std::array<long, 4> key = {0, 0, 0, cloud.view.empty() ? 0 : cloud.view[i]};
    for (int k = 0; k < 3; ++k) key[k] = std::lround(std::floor(p[k] / voxel_m));
    Cell& cell = cells[key];
    cell.sum += cloud.points[i];
    ++cell.count;
  }
  PointCloud thin;
  thin.sensor_origins = cloud.sensor_origins;
  thin.support = cloud.support;
  for (const auto& [key, cell] : cells) {
    thin.points.push_back(cell.sum / cell.count);
    if (!cloud.view.empty()) thin.view.push_back(static_cast<int>(key[3]));
  }
  return thin;
}

void fit_normals(PointCloud& cloud, int neighbours) {
  pcl::NormalEstimation<pcl::PointXYZ, pcl::Normal> estimation;
  estimation.setInputCloud(geometry::pcl_points(cloud.points, cloud.points.front()));
  estimation.setKSearch(neighbours);
  pcl::PointCloud<pcl::Normal> normals;
  estimation.compute(normals);
  for (const auto& n : normals) cloud.normals.push_back(n.getNormalVector3fMap().cast<double>().normalized());
}

void orient_to_sensors(PointCloud& cloud) {
  for (std::size_t i = 0; i < cloud.size(); ++i)
    if (cloud.normals[i].dot(cloud.sensor_origins[cloud.view[i]] - cloud.points[i]) < 0)
      cloud.normals[i] *= -1;
}

/// Without the points whose rays run along the surface rather than onto it, as between a silhouette and what
/// lies behind.
PointCloud without_grazing(const PointCloud& cloud, double grazing_deg) {
  const double least = std::cos(grazing_deg * M_PI / 180);
  std::vector<int> kept;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const Vec3 ray = (cloud.points[i] - cloud.sensor_origins[cloud.view[i]]).normalized();
    if (std::abs(ray.dot(cloud.normals[i])) >= least - 1e-12) kept.push_back(static_cast<int>(i));
  }
  return geometry::subset(cloud, kept);
}

void register_if_asked(const CloudParams& params, pipeline::Run& run, PointCloud& cloud) {
  if (params.registration == "none" || cloud.view.empty()) return;
  const auto done = register_views(cloud, params.icp_reach_m, params.icp_rounds);
  run.metric("registration_rms_before_m", done.rms_before_m);
  run.metric("registration_rms_after_m", done.rms_after_m);
  run.metric("registration_largest_move_m", done.largest_move_m);
}

void demand_enough(const PointCloud& cloud) {
  if (cloud.size() >= 50) return;
  throw pipeline::UserError(pipeline::Fault::geometry, "cloud",
                            fmt::format("only {} points are left, too few for a surface", cloud.size()),
                            "make cloud.voxel_m smaller or scan closer");
}

}  // namespace

PointCloud cloud(const CloudParams& params, pipeline::Run& run, const PointCloud& raw) {
  PointCloud placed = raw;
  placed.label.clear();
  demand_enough(placed);
  register_if_asked(params, run, placed);
  const PointCloud inliers = without_outliers(params, placed);
  demand_enough(inliers);
  const PointCloud smooth = params.smooth == "mls" ? smoothed(inliers, params.smooth_radius_m) : inliers;
  demand_enough(smooth);
  const PointCloud thin = thinned(smooth, params.voxel_m);
  PointCloud clean = thin;
  demand_enough(clean);
  fit_normals(clean, params.normal_neighbours);
  const bool sensors = !clean.sensor_origins.empty() && !clean.view.empty();
  if (sensors) {
    orient_to_sensors(clean);
    clean = without_grazing(clean, params.grazing_deg);
    demand_enough(clean);
  } else {
    orient_by_propagation(clean, params.normal_neighbours, params.seed);
  }
  const auto count = [](const PointCloud& c) { return static_cast<double>(c.size()); };
  run.metric("points_in", count(raw));
  run.metric("outliers", count(raw) - count(inliers));
  run.metric("lonely", count(inliers) - count(smooth));
  run.metric("thinned", count(smooth) - count(thin));
  run.metric("grazing", count(thin) - count(clean));
  run.metric("points", count(clean));
  run.metric("oriented_by_sensor", sensors);
  return clean;
}

}  // namespace geocage::stages
