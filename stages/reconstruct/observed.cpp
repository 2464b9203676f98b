#include "stages/reconstruct/observed.h"

#include <algorithm>
#include <cmath>

#include <pcl/kdtree/kdtree_flann.h>

#include "geometry/pcl_points.h"

namespace geocage::stages {

using geometry::PointCloud;
using geometry::Vec3;

namespace {

pcl::KdTreeFLANN<pcl::PointXYZ> tree_of(const PointCloud& cloud) {
  pcl::KdTreeFLANN<pcl::PointXYZ> tree;
  tree.setInputCloud(geometry::pcl_points(cloud.points));
  return tree;
}

/// 0 below 0, 1 above 1, smooth between.
double rise(double s) {
  s = std::clamp(s, 0.0, 1.0);
  return s * s * (3 - 2 * s);
}

}  // namespace

std::vector<double> observed_of(const geometry::TriangleMesh& mesh, const PointCloud& cloud, double near_m) {
  const auto tree = tree_of(cloud);
  const auto normals = geometry::vertex_normals(mesh);
  std::vector<double> observed(mesh.vertices.size(), 0);
  pcl::Indices nearest;
  std::vector<float> squared;
  for (std::size_t v = 0; v < observed.size(); ++v) {
    tree.nearestKSearch(geometry::pcl_point(mesh.vertices[v]), 8, nearest, squared);
    for (int i : nearest) {
      const double distance = (cloud.points[i] - mesh.vertices[v]).norm();
      const double near = rise(2 - distance / near_m), alike = rise(1 + 2 * normals[v].dot(cloud.normals[i]));
      observed[v] = std::max(observed[v], near * alike);
    }
  }
  return observed;
}

double mean_spacing_m(const PointCloud& cloud) {
  const auto tree = tree_of(cloud);
  const std::size_t stride = std::max<std::size_t>(1, cloud.size() / 2000);
  double sum = 0;
  int count = 0;
  pcl::Indices nearest;
  std::vector<float> squared;
  for (std::size_t i = 0; i < cloud.size(); i += stride) {
    tree.nearestKSearch(geometry::pcl_point(cloud.points[i]), 7, nearest,
                        squared);  // the first is the point itself
    for (std::size_t k = 1; k < squared.size(); ++k, ++count) sum += std::sqrt(squared[k]);
  }
  return count > 0 ? sum / count : 0;
}

}  // namespace geocage::stages
