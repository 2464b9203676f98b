#include "stages/reconstruct/walls.h"

#include <algorithm>

#include <pcl/kdtree/kdtree_flann.h>

#include "geometry/pcl_points.h"

namespace geocage::stages {

using geometry::Vec3;

ThickenedWalls thicken_walls(geometry::PointCloud& cloud, double wall_m) {
  constexpr int least_opposite = 4;
  ThickenedWalls done;
  if (wall_m <= 0) return done;
  const auto points = geometry::pcl_points(cloud.points, cloud.points.front());
  pcl::KdTreeFLANN<pcl::PointXYZ> tree;
  tree.setInputCloud(points);
  std::vector<Vec3> moved = cloud.points;
  std::vector<int> near;
  std::vector<float> squares;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const Vec3 &p = cloud.points[i], &n = cloud.normals[i];
    tree.radiusSearch((*points)[i], 1.5 * wall_m, near, squares);
    double sum = 0;
    int count = 0;
    for (int j : near) {
      const Vec3 across = p - cloud.points[j];
      if (n.dot(cloud.normals[j]) > -0.5 || (across - across.dot(n) * n).norm() > wall_m / 2) continue;
      sum += across.dot(n);
      ++count;
    }
    if (count < least_opposite) continue;
    const double thickness_m = sum / count;
    if (thickness_m >= wall_m || thickness_m < -0.4 * wall_m) continue;
    const double move_m = (wall_m - thickness_m) / 2;
    moved[i] += move_m * n;
    done.most_m = std::max(done.most_m, move_m);
    ++done.points;
  }
  cloud.points = std::move(moved);
  return done;
}

}  // namespace geocage::stages
