#include "stages/import/table.h"

#include <algorithm>
#include <map>
#include <numeric>
#include <random>

#include <Eigen/Eigenvalues>
#include <pcl/kdtree/kdtree_flann.h>
#include <pcl/segmentation/extract_clusters.h>

namespace geocage::stages {

using geometry::Plane;
using geometry::PointCloud;
using geometry::Vec3;

namespace {

constexpr double crumbs_per_gap = 4;

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

using Point2 = Eigen::Vector2d;

double turn(const Point2& a, const Point2& b, const Point2& c) {
  return (b - a).x() * (c - a).y() - (b - a).y() * (c - a).x();
}

/// Convex hull, counter-clockwise (Andrew's monotone chain).
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
    hull.pop_back();
    std::reverse(points.begin(), points.end());
  }
  return hull;
}

bool inside(const std::vector<Point2>& hull, const Point2& p) {
  for (std::size_t i = 0; i < hull.size(); ++i)
    if (turn(hull[i], hull[(i + 1) % hull.size()], p) < 0) return false;
  return hull.size() >= 3;
}

using Tree = pcl::search::KdTree<pcl::PointXYZ>;

/// Points that hang together by steps much shorter than the gap: a search for neighbours within the gap
/// itself would give a thousand for each point.
struct Crumb {
  std::vector<int> points;
  Tree tree;
  Eigen::AlignedBox3f box;

  bool near(const Crumb& other, double gap_m) const {
    if (points.size() > other.points.size()) return other.near(*this, gap_m);
    const auto gap2 = static_cast<float>(gap_m * gap_m);
    if (box.squaredExteriorDistance(other.box) > gap2) return false;
    std::vector<int> nearest;
    std::vector<float> distance2;
    return std::any_of(tree.getInputCloud()->begin(), tree.getInputCloud()->end(), [&](const auto& p) {
      if (other.box.squaredExteriorDistance(p.getVector3fMap().eval()) > gap2) return false;
      return other.tree.nearestKSearch(p, 1, nearest, distance2) > 0 && distance2.front() <= gap2;
    });
  }
};

std::vector<Crumb> crumbs_of(const PointCloud& cloud, const std::vector<int>& chosen, double gap_m) {
  pcl::PointCloud<pcl::PointXYZ>::Ptr points(new pcl::PointCloud<pcl::PointXYZ>);
  for (int i : chosen) {
    const Eigen::Vector3f p = cloud.points[i].cast<float>();
    points->emplace_back(p.x(), p.y(), p.z());
  }
  const Tree::Ptr tree(new Tree);
  tree->setInputCloud(points);
  pcl::EuclideanClusterExtraction<pcl::PointXYZ> extraction;
  extraction.setClusterTolerance(gap_m);
  extraction.setMinClusterSize(1);
  extraction.setSearchMethod(tree);
  extraction.setInputCloud(points);
  std::vector<pcl::PointIndices> parts;
  extraction.extract(parts);
  std::vector<Crumb> crumbs;
  for (auto& part : parts) {
    Crumb& crumb = crumbs.emplace_back();
    crumb.tree.setInputCloud(Tree::PointCloudPtr(new Tree::PointCloud(*points, part.indices)));
    for (const auto& p : *crumb.tree.getInputCloud()) crumb.box.extend(p.getVector3fMap().eval());
    crumb.points = std::move(part.indices);
  }
  return crumbs;
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
  const Eigen::Matrix3d frame = geometry::frame_from_z(table.plane.normal);
  const auto foot = [&](const Vec3& p) { return Point2(frame.col(0).dot(p), frame.col(1).dot(p)); };
  std::vector<Point2> feet;
  for (int i : table.on) feet.push_back(foot(cloud.points[i]));
  const auto hull = convex_hull(std::move(feet));
  std::vector<int> standing;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const Vec3& p = cloud.points[i];
    const double height = table.plane.height_m(p);
    if (height >= above_min_m && height <= above_max_m && inside(hull, foot(p)))
      standing.push_back(static_cast<int>(i));
  }
  return standing;
}

std::vector<std::vector<int>> clusters_of(const PointCloud& cloud, const std::vector<int>& chosen,
                                          double gap_m, int min_points) {
  if (chosen.empty()) return {};
  const auto crumbs = crumbs_of(cloud, chosen, gap_m / crumbs_per_gap);
  std::vector<int> name(crumbs.size());  // of the cluster that each belongs to
  std::iota(name.begin(), name.end(), 0);
  for (std::size_t a = 0; a < crumbs.size(); ++a)
    for (std::size_t b = 0; b < a; ++b)
      if (name[a] != name[b] && crumbs[a].near(crumbs[b], gap_m))
        std::replace(name.begin(), name.end(), int{std::max(name[a], name[b])},
                     int{std::min(name[a], name[b])});
  std::map<int, std::vector<int>> parts;
  for (std::size_t a = 0; a < crumbs.size(); ++a) {
    auto& part = parts[name[a]];
    for (int i : crumbs[a].points) part.push_back(chosen[i]);
  }
  std::vector<std::vector<int>> clusters;
  for (auto& [first, part] : parts) {
    if (static_cast<int>(part.size()) < min_points) continue;
    std::sort(part.begin(), part.end());
    clusters.push_back(std::move(part));
  }
  std::sort(clusters.begin(), clusters.end(),
            [](const auto& a, const auto& b) { return a.size() != b.size() ? a.size() > b.size() : a < b; });
  return clusters;
}

}  // namespace geocage::stages
