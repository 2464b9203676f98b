#include "stages/import/parts.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "stages/import/multicut.h"
#include "stages/import/part_joins.h"
#include "stages/import/patches.h"
#include "stages/import/sight.h"

namespace geocage::stages {

using geometry::Vec3;

namespace {

/// From the sensor on.
std::vector<Vec3> seen_from_sensor(const geometry::PointCloud& cloud, const std::vector<int>& chosen) {
  std::vector<Vec3> points;
  points.reserve(chosen.size());
  for (int i : chosen) points.push_back(cloud.points[i] - cloud.sensor_origins.front());
  return points;
}

std::vector<Vec3> seen_from_sensor(const geometry::PointCloud& cloud) {
  std::vector<int> all(cloud.size());
  std::iota(all.begin(), all.end(), 0);
  return seen_from_sensor(cloud, all);
}

/// What a border holds together: its length, less in a hollow, and nothing at the tolerance; hollower ones
/// push apart, at most twice as much as flat ones hold.
double bond_of(const Border& border, double tolerance_rad) {
  return border.length_m * std::clamp(1 - border.hollow_rad / tolerance_rad, -2.0, 1.0);
}

/// Patches, and which of them may belong together.
class Cut {
 public:
  Cut(const std::vector<Vec3>& points, const std::vector<std::vector<int>>& near, const Sight& sight,
      const PartRule& rule)
      : points_(points), sight_(sight), rule_(rule), patches_(patches_of(points, near, rule.patch_m)) {
    for (const Border& border : patches_.borders)
      bonds_.push_back({border.a, border.b, bond_of(border, rule.concavity_deg * M_PI / 180)});
    members_.resize(static_cast<std::size_t>(patches_.count));
    for (std::size_t i = 0; i < points.size(); ++i)
      members_[patches_.of_point[i]].push_back(static_cast<int>(i));
  }

  /// The part of each point.
  std::vector<int> parts() const {
    const auto part =
        multicut(patches_.count, bonds_, [&](const Nodes& a, const Nodes& b) { return hold_together(a, b); });
    std::vector<int> name;
    for (int patch : patches_.of_point) name.push_back(part[patch]);
    return name;
  }

 private:
  using Nodes = std::vector<int>;
  static constexpr double groove_share = 0.2;  ///< of a border that is one, pushes apart
  static constexpr double narrow_share = 0.4;  ///< of the smaller side's width: a shorter border is a neck
  static constexpr double most_empty = 0.05;   ///< between two pieces of one convex thing: noise

  /// Large pieces that meet in a groove or a neck must be convex together. Two cans' lids make one plane, but
  /// the groove between the cans is empty; a banana's halves meet along their whole width.
  bool hold_together(const Nodes& a, const Nodes& b) const {
    const auto of_a = points_of(a), of_b = points_of(b);
    const auto smaller = std::min(of_a.size(), of_b.size());
    if (static_cast<int>(smaller) < rule_.points) return true;
    double hold = 0, push = 0;
    std::vector<char> side(static_cast<std::size_t>(patches_.count), 0);
    for (int node : a) side[node] = 1;
    for (int node : b) side[node] = 2;
    for (const Bond& bond : bonds_)
      if (side[bond.a] + side[bond.b] == 3) (bond.weight > 0 ? hold : push) += std::abs(bond.weight);
    const double width_m = std::sqrt(static_cast<double>(smaller)) * patches_.spacing_m;
    if (push <= groove_share * hold && hold >= narrow_share * width_m) return true;
    return sight_.emptiness_between(of_a, of_b, clear_m) < most_empty;
  }

  std::vector<Vec3> points_of(const Nodes& nodes) const {
    std::vector<Vec3> list;
    for (int node : nodes)
      for (int i : members_[node]) list.push_back(points_[i]);
    return list;
  }

  const std::vector<Vec3>& points_;
  const Sight& sight_;
  const PartRule& rule_;
  const Patches patches_;
  std::vector<Bond> bonds_;
  std::vector<std::vector<int>> members_;  ///< points of each patch
};

}  // namespace

std::vector<std::vector<int>> parts_by_shape(const geometry::PointCloud& cloud,
                                             const std::vector<int>& cluster, const geometry::Plane& table,
                                             const PartRule& rule) {
  constexpr double flat_m = 0.045;
  const auto lower = [&](int i, int j) {
    return table.height_m(cloud.points[i]) < table.height_m(cloud.points[j]);
  };
  const int top = *std::max_element(cluster.begin(), cluster.end(), lower);
  if (table.height_m(cloud.points[top]) < flat_m) return {cluster};  // a hammer's head at its handle
  const Sight sight(seen_from_sensor(cloud));
  const auto points = seen_from_sensor(cloud, cluster);
  const auto near = near_points(points, rule.patch_m / 2);
  PartJoins parts(cloud, cluster, Cut(points, near, sight, rule).parts(), near, sight, table);
  parts.join_fragments(rule.points);
  parts.join_what_is_convex();
  parts.join_insides();
  parts.join_what_lies_inside();
  parts.join_what_has_no_stand();
  parts.join_insides();
  parts.join_strays(rule.points);
  return parts.indices();
}

}  // namespace geocage::stages
