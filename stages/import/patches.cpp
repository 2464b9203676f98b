#include "stages/import/patches.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include <Eigen/Eigenvalues>
#include <pcl/kdtree/kdtree_flann.h>
#include <pcl/segmentation/supervoxel_clustering.h>

#include "geometry/median.h"
#include "geometry/pcl_points.h"

namespace geocage::stages {

using geometry::Vec3;

namespace {

/// A point in no patch belongs to that of its nearest neighbour that has one; those without any get one.
void name_the_nameless(std::vector<int>& patch, const std::vector<std::vector<int>>& near, int& count) {
  for (bool changed = true; changed;) {
    changed = false;
    for (std::size_t i = 0; i < patch.size(); ++i) {
      if (patch[i] >= 0) continue;
      const auto named = std::find_if(near[i].begin(), near[i].end(), [&](int j) { return patch[j] >= 0; });
      if (named == near[i].end()) continue;
      patch[i] = patch[*named];
      changed = true;
    }
  }
  bool rest = false;
  for (int& p : patch)
    if (p < 0) {
      p = count;
      rest = true;
    }
  count += rest;
}

/// How far each point of a patch lies from the nearest of those at the border.
std::vector<double> from_border(const std::vector<Vec3>& points, const std::vector<int>& patch,
                                const std::vector<int>& border) {
  std::vector<double> distance2;
  for (int i : patch) {
    double least = 1;
    for (int j : border) least = std::min(least, (points[i] - points[j]).squaredNorm());
    distance2.push_back(least);
  }
  return distance2;
}

Flat flat_near(const std::vector<Vec3>& points, const std::vector<int>& patch,
               const std::vector<double>& distance2, double within_m) {
  std::vector<Vec3> near;
  for (std::size_t k = 0; k < patch.size(); ++k)
    if (distance2[k] < within_m * within_m) near.push_back(points[patch[k]]);
  return flat_of(near);
}

double hollow_between(const Flat& a, const Flat& b) {
  const double angle = std::acos(std::clamp(a.normal.dot(b.normal), -1.0, 1.0));
  return (a.normal - b.normal).dot(a.middle - b.middle) < 0 ? angle : -angle;
}

double median_gap_m(const std::vector<Vec3>& points, const std::vector<std::vector<int>>& near) {
  std::vector<double> gaps;
  for (std::size_t i = 0; i < points.size(); ++i)
    if (!near[i].empty()) gaps.push_back((points[i] - points[near[i].front()]).norm());
  return geometry::median(std::move(gaps));
}

std::vector<Border> borders_of(const std::vector<Vec3>& points, const std::vector<std::vector<int>>& near,
                               const Patches& patches, double size_m) {
  std::vector<std::vector<int>> members(static_cast<std::size_t>(patches.count));
  for (std::size_t i = 0; i < points.size(); ++i) members[patches.of_point[i]].push_back(static_cast<int>(i));
  std::map<std::pair<int, int>, std::vector<int>> meeting;  // points at the border, of both sides
  for (std::size_t i = 0; i < points.size(); ++i)
    for (int j : near[i]) {
      const int a = patches.of_point[i], b = patches.of_point[j];
      if (a == b) continue;
      auto& at = meeting[{std::min(a, b), std::max(a, b)}];
      at.push_back(static_cast<int>(i));
      at.push_back(j);
    }
  std::vector<Border> borders;
  for (auto& [pair, at] : meeting) {
    std::sort(at.begin(), at.end());
    at.erase(std::unique(at.begin(), at.end()), at.end());
    const auto [a, b] = pair;
    const auto of_a = from_border(points, members[a], at), of_b = from_border(points, members[b], at);
    const auto hollow = [&](double within_m) -> std::optional<double> {
      const Flat flat_a = flat_near(points, members[a], of_a, within_m),
                 flat_b = flat_near(points, members[b], of_b, within_m);
      if (flat_a.normal.isZero() || flat_b.normal.isZero()) return std::nullopt;
      return hollow_between(flat_a, flat_b);
    };
    const auto wide = hollow(size_m), narrow = hollow(size_m / 2);
    const double crease = wide && narrow ? 2 * *narrow - *wide : wide.value_or(0);
    // Two or three rows of points on either side have a neighbour on the other.
    borders.push_back({a, b, static_cast<double>(at.size()) / 4 * patches.spacing_m, crease});
  }
  return borders;
}

}  // namespace

Flat flat_of(const std::vector<Vec3>& points) {
  Flat flat;
  if (points.empty()) return flat;
  for (const Vec3& p : points) flat.middle += p;
  flat.middle /= static_cast<double>(points.size());
  if (points.size() < 8) return flat;
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const Vec3& p : points) scatter += (p - flat.middle) * (p - flat.middle).transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(scatter);
  flat.normal = axes.eigenvectors().col(0);
  if (flat.normal.dot(flat.middle) > 0) flat.normal = -flat.normal;
  flat.off_m = std::sqrt(std::max(0.0, axes.eigenvalues()[0]) / static_cast<double>(points.size()));
  return flat;
}

std::vector<std::vector<int>> near_points(const std::vector<Vec3>& points, double reach_m) {
  pcl::KdTreeFLANN<pcl::PointXYZ> tree;
  const auto cloud = geometry::pcl_points(points);
  tree.setInputCloud(cloud);
  std::vector<int> found;
  std::vector<float> squares;
  std::vector<std::vector<int>> near;
  for (std::size_t i = 0; i < points.size(); ++i) {
    tree.nearestKSearch((*cloud)[i], 9, found, squares);
    auto& mine = near.emplace_back();
    for (std::size_t k = 0; k < found.size(); ++k)
      if (found[k] != static_cast<int>(i) && squares[k] < reach_m * reach_m) mine.push_back(found[k]);
  }
  return near;
}

Patches patches_of(const std::vector<Vec3>& points, const std::vector<std::vector<int>>& near,
                   double size_m) {
  const auto patch = static_cast<float>(size_m), voxel = patch / 4;
  pcl::SupervoxelClustering<pcl::PointXYZ> search(voxel, patch);
  search.setUseSingleCameraTransform(false);
  search.setInputCloud(geometry::pcl_points(points));
  search.setColorImportance(0);
  search.setSpatialImportance(1);
  search.setNormalImportance(4);
  std::map<std::uint32_t, pcl::Supervoxel<pcl::PointXYZ>::Ptr> found;
  search.extract(found);
  std::map<std::uint32_t, int> number;
  for (const auto& [name, patch_found] : found) number.emplace(name, static_cast<int>(number.size()));
  Patches patches;
  patches.count = static_cast<int>(number.size());
  const auto labelled = search.getLabeledCloud();
  for (const auto& p : *labelled) {
    const auto known = number.find(p.label);
    patches.of_point.push_back(known == number.end() ? -1 : known->second);
  }
  name_the_nameless(patches.of_point, near, patches.count);
  patches.spacing_m = median_gap_m(points, near);
  patches.borders = borders_of(points, near, patches, size_m);
  return patches;
}

}  // namespace geocage::stages
