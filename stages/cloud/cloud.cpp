#include "stages/cloud/cloud.h"

#include <array>
#include <map>

#include <fmt/format.h>
#include <pcl/features/normal_3d.h>
#include <pcl/filters/statistical_outlier_removal.h>
#include <pcl/kdtree/kdtree_flann.h>

#include "pipeline/error.h"
#include "stages/cloud/orient.h"

namespace geocage::stages {

using geometry::PointCloud;
using geometry::Vec3;

void CloudParams::visit(pipeline::Fields& f) {
  f("outlier_neighbours", outlier_neighbours, {2, 1000}, "neighbours whose mean distance tells outliers");
  f("outlier_sigmas", outlier_sigmas, {0.1, 100},
    "a point is dropped when that distance is so many deviations above the mean");
  f("voxel_m", voxel_m, {1e-4, 0.1}, "one point is kept for each voxel of this size");
  f("normal_neighbours", normal_neighbours, {4, 1000}, "neighbours that a normal is fitted to");
  f("seed", seed, "of the propagation of normals where no sensor is known");
}

namespace {

using Points = pcl::PointCloud<pcl::PointXYZ>;

Points::Ptr to_pcl(const std::vector<Vec3>& points) {
  Points::Ptr out(new Points);
  for (const Vec3& p : points)
    out->emplace_back(static_cast<float>(p.x()), static_cast<float>(p.y()), static_cast<float>(p.z()));
  return out;
}

PointCloud without_outliers(const CloudParams& params, const PointCloud& raw) {
  pcl::StatisticalOutlierRemoval<pcl::PointXYZ> filter;
  filter.setInputCloud(to_pcl(raw.points));
  filter.setMeanK(params.outlier_neighbours);
  filter.setStddevMulThresh(params.outlier_sigmas);
  pcl::Indices kept;
  filter.filter(kept);
  PointCloud cloud;
  cloud.sensor_origins = raw.sensor_origins;
  cloud.support = raw.support;
  for (int i : kept) {
    cloud.points.push_back(raw.points[i]);
    if (!raw.view.empty()) cloud.view.push_back(raw.view[i]);
  }
  return cloud;
}

/// One point for each voxel and view: the mean of those in it. Views stay apart so that each point keeps its
/// sensor.
PointCloud thinned(const PointCloud& cloud, double voxel_m) {
  struct Cell {
    Vec3 sum = Vec3::Zero();
    int count = 0;
  };
  std::map<std::array<long, 4>, Cell> cells;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const Vec3& p = cloud.points[i];
    std::array<long, 4> key = {0, 0, 0, cloud.view.empty() ? 0 : cloud.view[i]};
    for (int k = 0; k < 3; ++k) key[k] = std::lround(std::floor(p[k] / voxel_m));
    Cell& cell = cells[key];
    cell.sum += p;
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
  estimation.setInputCloud(to_pcl(cloud.points));
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

}  // namespace

PointCloud cloud(const CloudParams& params, pipeline::Run& run, const PointCloud& raw) {
  const PointCloud inliers = without_outliers(params, raw);
  PointCloud clean = thinned(inliers, params.voxel_m);
  run.metric("points_in", static_cast<double>(raw.size()));
  run.metric("outliers", static_cast<double>(raw.size() - inliers.size()));
  run.metric("thinned", static_cast<double>(inliers.size() - clean.size()));
  run.metric("points", static_cast<double>(clean.size()));
  if (clean.size() < 50)
    throw pipeline::UserError(pipeline::Fault::geometry, "cloud",
                              fmt::format("only {} points are left, too few for a surface", clean.size()),
                              "make cloud.voxel_m smaller or scan closer");
  fit_normals(clean, params.normal_neighbours);
  const bool sensors = !clean.sensor_origins.empty() && !clean.view.empty();
  if (sensors)
    orient_to_sensors(clean);
  else
    orient_by_propagation(clean, params.normal_neighbours, params.seed);
  run.metric("oriented_by_sensor", sensors);
  return clean;
}

}  // namespace geocage::stages
