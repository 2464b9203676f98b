#include "stages/import/parts.h"

#include <algorithm>
#include <cmath>
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

std::vector<Vec3> all_round() {
  constexpr int count = 200;
  std::vector<Vec3> directions;
  for (int k = 0; k < count; ++k) directions.push_back(geometry::lattice_direction(k, count));
  return directions;
}

std::vector<Vec3> along_table(const geometry::Plane& table) {
  constexpr int count = 64;
  const Eigen::Matrix3d frame = geometry::frame_from_z(table.normal);
  std::vector<Vec3> directions;
  for (int k = 0; k < count; ++k) {
    const double turn = 2 * M_PI * k / count;
    directions.emplace_back(frame * Vec3(std::cos(turn), std::sin(turn), 0));
  }
  return directions;
}

/// A convex outline of points: how far they reach in each of many directions.
class Outline {
 public:
  Outline(const std::vector<Vec3>& points, std::vector<Vec3> directions)
      : directions_(std::move(directions)) {
    for (const Vec3& d : directions_) {
      double reach = d.dot(points.front());
      for (const Vec3& p : points) reach = std::max(reach, d.dot(p));
      reach_.push_back(reach);
    }
  }
  double share_inside(const std::vector<Vec3>& points) const {
    const auto inside = std::count_if(points.begin(), points.end(), [&](const Vec3& p) { return holds(p); });
    return static_cast<double>(inside) / static_cast<double>(points.size());
  }

 private:
  bool holds(const Vec3& p) const {
    for (std::size_t k = 0; k < directions_.size(); ++k)
      if (directions_[k].dot(p) > reach_[k]) return false;
    return true;
  }
  std::vector<Vec3> directions_;
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

  /// A thing stands on the table or rests on another. What hangs at the side of its neighbours (a handle, the
  /// far wall of a cup) is a part of the one that it touches most, and what stands where another thing stands
  /// (a cup's inside) is that thing.
  void join_what_has_no_stand(const geometry::Plane& table) {
    for (bool joined = true; joined;) {
      joined = false;
      for (const auto& [name, sides] : contacts()) {
        const int home = home_of(name, sides, table);
        if (home == name) continue;
        rename(name, home);
        joined = true;
        break;
      }
    }
  }

  /// Points without a neighbour in another part, too few for a thing, belong to the nearest part that is one.
  void join_strays(int least_points) {
    const auto size = sizes();
    std::vector<int> home;
    for (std::size_t i = 0; i < name_.size(); ++i)
      if (size.at(name_[i]) >= least_points) home.push_back(static_cast<int>(i));
    if (home.empty()) return;
    std::vector<int> joined = name_;
    for (std::size_t i = 0; i < name_.size(); ++i) {
      if (size.at(name_[i]) >= least_points) continue;
      const auto distance2 = [&](int j) {
        return (cloud_.points[cluster_[j]] - cloud_.points[cluster_[i]]).squaredNorm();
      };
      joined[i] = name_[*std::min_element(home.begin(), home.end(),
                                          [&](int a, int b) { return distance2(a) < distance2(b); })];
    }
    name_ = std::move(joined);
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
  static constexpr double standing_m = 0.03;     ///< lower than that, it stands on the table
  static constexpr double resting_share = 0.35;  ///< contacts in the lowest third of a thing carry it

  static constexpr double level_m = 0.008;    ///< what carries a thing is level to this
  static constexpr double shared_foot = 0.2;  ///< two things can't stand in one place

  /// Heights of a part above the table, but for some outliers.
  struct Reach {
    double low_m, high_m;
    double share_of(double height_m) const { return (height_m - low_m) / std::max(1e-6, high_m - low_m); }
  };
  Reach reach_of(int name, const geometry::Plane& table) const {
    std::vector<double> heights;
    for (const Vec3& p : points_of(name)) heights.push_back(table.height_m(p));
    std::sort(heights.begin(), heights.end());
    const std::size_t few = heights.size() / 50;
    return {heights[few], heights[heights.size() - 1 - few]};
  }
  /// The part that a part belongs to: itself where it has a stand of its own.
  int home_of(int name, const std::map<int, int>& sides, const geometry::Plane& table) const {
    const Reach reach = reach_of(name, table);
    const auto on = [&](int one, int other) {
      const Contact contact = contact_of(one, other, table);
      return contact.spread_m < level_m && reach_of(one, table).share_of(contact.middle_m) < resting_share;
    };
    const bool rests =
        std::any_of(sides.begin(), sides.end(), [&](const auto& side) { return on(name, side.first); });
    if (rests && reach.low_m > standing_m) return name;
    if (!rests && reach.low_m > standing_m)
      return std::max_element(sides.begin(), sides.end(),
                              [](const auto& a, const auto& b) { return a.second < b.second; })
          ->first;
    for (const auto& [other, pairs] : sides)
      if (!on(other, name) &&
          Outline(points_of(other), along_table(table)).share_inside(points_of(name)) > shared_foot)
        return other;
    return name;
  }
  /// Heights of the points of a part and another where they touch.
  struct Contact {
    double middle_m, spread_m;  ///< median, and the distance of the quartiles
  };
  Contact contact_of(int name, int other, const geometry::Plane& table) const {
    std::vector<double> heights;
    for (std::size_t i = 0; i < name_.size(); ++i)
      for (int j : neighbours_[i])
        if ((name_[i] == name && name_[j] == other) || (name_[i] == other && name_[j] == name))
          heights.push_back(table.height_m(cloud_.points[cluster_[i]]));
    std::sort(heights.begin(), heights.end());
    const std::size_t quarter = heights.size() / 4;
    return {heights[heights.size() / 2], heights[heights.size() - 1 - quarter] - heights[quarter]};
  }

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
    return Outline(points_of(other), all_round()).share_inside(points_of(name));
  }

  const geometry::PointCloud& cloud_;
  const std::vector<int>& cluster_;
  std::vector<int> name_;
  std::vector<std::vector<int>> neighbours_;
};

}  // namespace

std::vector<std::vector<int>> convex_parts(const geometry::PointCloud& cloud, const std::vector<int>& cluster,
                                           const geometry::Plane& table, const PartRule& rule) {
  constexpr double flat_m = 0.045;
  const auto lower = [&](int i, int j) {
    return table.height_m(cloud.points[i]) < table.height_m(cloud.points[j]);
  };
  const int top = *std::max_element(cluster.begin(), cluster.end(), lower);
  if (table.height_m(cloud.points[top]) < flat_m) return {cluster};  // a hammer's head at its handle
  const auto points = to_pcl(cloud, cluster);
  Parts parts(cloud, cluster, patches_joined(points, rule), points, rule.patch_m / 2);
  parts.join_fragments(rule.points);
  parts.join_what_lies_inside();
  parts.join_what_has_no_stand(table);
  parts.join_strays(rule.points);
  return parts.indices();
}

}  // namespace geocage::stages
