#include "stages/import/parts.h"

#include <algorithm>
#include <map>

#include <pcl/kdtree/kdtree_flann.h>
#include <pcl/segmentation/lccp_segmentation.h>
#include <pcl/segmentation/supervoxel_clustering.h>

#include "geometry/depth_camera.h"

namespace geocage::stages {

using geometry::Vec3;

namespace {

using Points = pcl::PointCloud<pcl::PointXYZ>;

/// From the sensor on, for that is where PCL turns its normals to.
Points::Ptr to_pcl(const geometry::PointCloud& cloud, const std::vector<int>& chosen) {
  Points::Ptr points(new Points);
  for (int i : chosen) {
    const Eigen::Vector3f p = (cloud.points[i] - cloud.sensor_origins.front()).cast<float>();
    points->emplace_back(p.x(), p.y(), p.z());
  }
  return points;
}

/// The part of each point as PCL sees it; 0 for points in no patch.
std::vector<int> patches_joined(const Points::Ptr& points, const PartRule& rule) {
  const auto patch = static_cast<float>(rule.patch_m), voxel = patch / 4;
  pcl::SupervoxelClustering<pcl::PointXYZ> patches(voxel, patch);
  patches.setUseSingleCameraTransform(false);
  patches.setInputCloud(points);
  patches.setColorImportance(0);
  patches.setSpatialImportance(1);
  patches.setNormalImportance(4);
  std::map<std::uint32_t, pcl::Supervoxel<pcl::PointXYZ>::Ptr> found;
  patches.extract(found);
  std::multimap<std::uint32_t, std::uint32_t> touching;
  patches.getSupervoxelAdjacency(touching);
  pcl::LCCPSegmentation<pcl::PointXYZ> parts;
  parts.setConcavityToleranceThreshold(static_cast<float>(rule.concavity_deg));
  parts.setSanityCheck(true);
  parts.setSmoothnessCheck(true, voxel, patch, 0.1F);
  parts.setKFactor(0);
  parts.setInputSupervoxels(found, touching);
  parts.setMinSegmentSize(3);
  parts.segment();
  const auto labelled = patches.getLabeledCloud();
  parts.relabelCloud(*labelled);
  std::vector<int> label;
  for (const auto& p : *labelled) label.push_back(static_cast<int>(p.label));
  return label;
}

/// A convex outline of points: how far they reach in each of many directions.
class Outline {
 public:
  explicit Outline(const std::vector<Vec3>& points) {
    for (int k = 0; k < directions; ++k) {
      const Vec3 d = geometry::lattice_direction(k, directions);
      double reach = d.dot(points.front());
      for (const Vec3& p : points) reach = std::max(reach, d.dot(p));
      reach_.push_back(reach);
    }
  }
  bool holds(const Vec3& p) const {
    for (int k = 0; k < directions; ++k)
      if (geometry::lattice_direction(k, directions).dot(p) > reach_[k]) return false;
    return true;
  }

 private:
  static constexpr int directions = 200;
  std::vector<double> reach_;
};

/// Parts under way: a name a point, and how many pairs of near points each two parts share.
class Parts {
 public:
  Parts(const geometry::PointCloud& cloud, const std::vector<int>& cluster, std::vector<int> name,
        const Points::Ptr& points, double reach_m)
      : cloud_(cloud), cluster_(cluster), name_(std::move(name)) {
    pcl::KdTreeFLANN<pcl::PointXYZ> tree;
    tree.setInputCloud(points);
    find_neighbours(tree, points, reach_m);
    name_the_nameless();
  }

  void join_fragments(int most_points) {
    for (;;) {
      const auto size = sizes();
      const auto touch = contacts();
      int fragment = 0;
      for (const auto& [name, count] : size)
        if (count < most_points && touch.contains(name) && (fragment == 0 || count < size.at(fragment)))
          fragment = name;
      if (fragment == 0) return;
      const auto& sides = touch.at(fragment);
      const auto most = std::max_element(sides.begin(), sides.end(),
                                         [](const auto& a, const auto& b) { return a.second < b.second; });
      rename(fragment, most->first);
    }
  }

  void join_what_lies_inside() {
    for (bool joined = true; joined;) {
      joined = false;
      for (const auto& [name, sides] : contacts()) {
        for (const auto& [other, pairs] : sides)
          if (!joined && inside_share(name, other) > 0.5) {
            rename(name, other);
            joined = true;
          }
        if (joined) break;
      }
    }
  }

  std::vector<std::vector<int>> indices() const {
    std::map<int, std::vector<int>> parts;
    for (std::size_t i = 0; i < cluster_.size(); ++i) parts[name_[i]].push_back(cluster_[i]);
    std::vector<std::vector<int>> list;
    for (auto& [name, part] : parts) list.push_back(std::move(part));
    return list;
  }

 private:
  void find_neighbours(pcl::KdTreeFLANN<pcl::PointXYZ>& tree, const Points::Ptr& points, double reach_m) {
    std::vector<int> near;
    std::vector<float> squares;
    for (std::size_t i = 0; i < points->size(); ++i) {
      tree.nearestKSearch((*points)[i], 9, near, squares);
      auto& mine = neighbours_.emplace_back();
      for (std::size_t k = 0; k < near.size(); ++k)
        if (near[k] != static_cast<int>(i) && squares[k] < reach_m * reach_m) mine.push_back(near[k]);
    }
  }

  /// A point in no patch gets the name of its nearest neighbour that has one, or one of its own.
  void name_the_nameless() {
    for (bool changed = true; changed;) {
      changed = false;
      for (std::size_t i = 0; i < name_.size(); ++i)
        for (std::size_t k = 0; k < neighbours_[i].size() && name_[i] == 0; ++k)
          if (name_[neighbours_[i][k]] != 0) {
            name_[i] = name_[neighbours_[i][k]];
            changed = true;
          }
    }
    const int rest = *std::max_element(name_.begin(), name_.end()) + 1;
    std::replace(name_.begin(), name_.end(), 0, rest);
  }

  std::map<int, int> sizes() const {
    std::map<int, int> count;
    for (int name : name_) ++count[name];
    return count;
  }
  std::map<int, std::map<int, int>> contacts() const {
    std::map<int, std::map<int, int>> pairs;
    for (std::size_t i = 0; i < name_.size(); ++i)
      for (int j : neighbours_[i])
        if (name_[i] != name_[j]) {
          ++pairs[name_[i]][name_[j]];
          ++pairs[name_[j]][name_[i]];
        }
    return pairs;
  }
  void rename(int from, int to) { std::replace(name_.begin(), name_.end(), from, to); }

  std::vector<Vec3> points_of(int name) const {
    std::vector<Vec3> points;
    for (std::size_t i = 0; i < name_.size(); ++i)
      if (name_[i] == name) points.push_back(cloud_.points[cluster_[i]]);
    return points;
  }
  double inside_share(int name, int other) const {
    const Outline outline(points_of(other));
    const auto points = points_of(name);
    const auto inside =
        std::count_if(points.begin(), points.end(), [&](const Vec3& p) { return outline.holds(p); });
    return static_cast<double>(inside) / static_cast<double>(points.size());
  }

  const geometry::PointCloud& cloud_;
  const std::vector<int>& cluster_;
  std::vector<int> name_;
  std::vector<std::vector<int>> neighbours_;
};

}  // namespace

std::vector<std::vector<int>> convex_parts(const geometry::PointCloud& cloud, const std::vector<int>& cluster,
                                           const PartRule& rule) {
  const auto points = to_pcl(cloud, cluster);
  Parts parts(cloud, cluster, patches_joined(points, rule), points, rule.patch_m / 2);
  parts.join_fragments(rule.points);
  parts.join_what_lies_inside();
  return parts.indices();
}

}  // namespace geocage::stages
