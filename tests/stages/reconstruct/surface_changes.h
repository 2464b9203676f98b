#pragma once
#include <algorithm>
#include <random>

#include "datasets/shapes.h"
#include "geometry/cloud.h"
#include "geometry/surface_distance.h"

// What should change nothing but rounding in a surface made of points, and how far two surfaces lie apart.
namespace geocage::tests {

/// The vertices of a mesh with its normals, moved along them by noise.
inline geometry::PointCloud cloud_of(const geometry::TriangleMesh& mesh, double sigma_m) {
  std::mt19937_64 random(1);
  std::normal_distribution<> noise(0, 1);
  geometry::PointCloud cloud;
  cloud.normals = vertex_normals(mesh);
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i)
    cloud.points.push_back(mesh.vertices[i] + sigma_m * noise(random) * cloud.normals[i]);
  return cloud;
}

inline geometry::PointCloud shuffled(geometry::PointCloud cloud) {
  std::mt19937_64 random(3);
  for (std::size_t i = cloud.size() - 1; i > 0; --i) {
    const std::size_t j = random() % (i + 1);
    std::swap(cloud.points[i], cloud.points[j]);
    std::swap(cloud.normals[i], cloud.normals[j]);
  }
  return cloud;
}

/// Points and their surface alike, by `angle_rad` about an axis that is none of theirs.
inline void turn(geometry::PointCloud& cloud, geometry::TriangleMesh& mesh, double angle_rad) {
  const Eigen::Matrix3d R =
      Eigen::AngleAxisd(angle_rad, geometry::Vec3(1, 2, -1).normalized()).toRotationMatrix();
  for (auto* list : {&cloud.points, &cloud.normals, &mesh.vertices})
    for (geometry::Vec3& p : *list) p = R * p;
}

inline double hausdorff_m(const geometry::TriangleMesh& a, const geometry::TriangleMesh& b) {
  return std::max(deviation(a, geometry::SurfaceDistance(b), 0.001).max_m,
                  deviation(b, geometry::SurfaceDistance(a), 0.001).max_m);
}

/// No two of its axes alike, and each with one end larger than the other.
inline geometry::TriangleMesh pear() {
  auto mesh = datasets::icosphere(0.05, 5);
  for (geometry::Vec3& p : mesh.vertices) {
    const geometry::Vec3 n = p.normalized();
    p = (1 + 0.3 * n.z() + 0.15 * n.x() * n.z() + 0.1 * n.y() * n.y() * n.y()) *
        p.cwiseProduct(geometry::Vec3(0.7, 0.85, 1));
  }
  return mesh;
}

}  // namespace geocage::tests
