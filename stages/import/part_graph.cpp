#include "stages/import/part_graph.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "geometry/depth_camera.h"
#include "geometry/median.h"
#include "stages/import/boxed.h"
#include "stages/import/multicut.h"
#include "stages/import/turned.h"

namespace geocage::stages {

using geometry::Vec3;

namespace {

constexpr double far_m = 0.2;  ///< axes of surfaces that don't turn lie anywhere

std::vector<Vec3> all_round() {
  constexpr int count = 200;
  std::vector<Vec3> directions;
  directions.reserve(count);
  for (int k = 0; k < count; ++k) directions.push_back(geometry::lattice_direction(k, count));
  return directions;
}

std::vector<Vec3> along_table(const geometry::Plane& table) {
  constexpr int count = 64;
  const Eigen::Matrix3d frame = geometry::frame_from_z(table.normal);
  std::vector<Vec3> directions;
  directions.reserve(count);
  for (int k = 0; k < count; ++k) {
    const double turn = 2 * M_PI * k / count;
    directions.emplace_back(frame * Vec3(std::cos(turn), std::sin(turn), 0));
  }
  return directions;
}

/// What a border holds together: its length, less in a hollow, and nothing at the tolerance; hollower ones
/// push apart, at most twice as much as flat ones hold.
double bond_of(const Border& border, double tolerance_rad) {
  return border.length_m * std::clamp(1 - border.hollow_rad / tolerance_rad, -2.0, 1.0);
}

/// How far points lie from a plane of this normal; a few points of something else don't count.
double unevenness_m(const std::vector<Vec3>& points, const Vec3& normal) {
  std::vector<double> height;
  height.reserve(points.size());
  for (const Vec3& p : points) height.push_back(normal.dot(p));
  const double at = geometry::median(height);
  for (double& h : height) h = std::abs(h - at);
  return geometry::deviation_of_sizes(std::move(height));
}

std::vector<double> outline_of(const std::vector<Vec3>& points, const std::vector<Vec3>& directions) {
  std::vector<double> reach;
  reach.reserve(directions.size());
  for (const Vec3& d : directions) {
    double most = d.dot(points.front());
    for (const Vec3& p : points) most = std::max(most, d.dot(p));
    reach.push_back(most);
  }
  return reach;
}

std::vector<double> farther(std::vector<double> one, const std::vector<double>& other) {
  for (std::size_t k = 0; k < one.size(); ++k) one[k] = std::max(one[k], other[k]);
  return one;
}

/// Least and largest width of an outline along the table.
std::pair<double, double> widths_of(const std::vector<double>& outline) {
  double least = std::numeric_limits<double>::infinity(), most = 0;
  for (std::size_t k = 0; k < outline.size() / 2; ++k) {
    const double wide = outline[k] + outline[k + outline.size() / 2];
    least = std::min(least, wide);
    most = std::max(most, wide);
  }
  return {least, most};
}

double share_inside(const std::vector<double>& outline, const std::vector<Vec3>& directions,
                    const std::vector<Vec3>& points) {
  const auto inside = std::count_if(points.begin(), points.end(), [&](const Vec3& p) {
    for (std::size_t k = 0; k < directions.size(); ++k)
      if (directions[k].dot(p) > outline[k]) return false;
    return true;
  });
  return static_cast<double>(inside) / static_cast<double>(points.size());
}

}  // namespace

PartGraph::PartGraph(const geometry::PointCloud& cloud, const Sight& sight, const std::vector<int>& cluster,
                     const geometry::Plane& table, const PartRule& rule)
    : cloud_(cloud),
      cluster_(cluster),
      table_(table),
      rule_(rule),
      sight_(sight),
      round_(all_round()),
      level_(along_table(table)) {
  Points seen;
  for (int i : cluster) seen.push_back(cloud.points[i] - cloud.sensor_origins.front());
  near_ = near_points(seen, rule.patch_m / 2);
  patches_ = patches_of(seen, near_, rule.patch_m);
  cut(seen);
  std::map<int, std::vector<int>> members;
  for (std::size_t i = 0; i < seen.size(); ++i)
    members[of_patch_[patches_.of_point[i]]].push_back(static_cast<int>(i));
  for (const auto& [name, list] : members) {
    Part& part = parts_.emplace(name, part_of(list)).first->second;
    part.hull = outline_of(part.points, round_);
    part.foot = outline_of(part.points, level_);
  }
  find_contacts();
}

void PartGraph::cut(const Points& seen) {
  std::vector<Bond> bonds;
  for (const Border& border : patches_.borders)
    bonds.push_back({border.a, border.b, bond_of(border, rule_.concavity_deg * M_PI / 180)});
  std::vector<std::vector<int>> members(static_cast<std::size_t>(patches_.count));
  for (std::size_t i = 0; i < seen.size(); ++i) members[patches_.of_point[i]].push_back(static_cast<int>(i));
  const auto points_of = [&](const std::vector<int>& nodes) {
    Points list;
    for (int node : nodes)
      for (int i : members[node]) list.push_back(seen[i]);
    return list;
  };
  // Large pieces that meet in a groove or a neck must be convex together. Two cans' lids make one plane, but
  // the groove between the cans is empty; a banana's halves meet along their whole width.
  const auto may_join = [&](const std::vector<int>& a, const std::vector<int>& b) {
    constexpr double groove_share = 0.2;  // of a border that is one, pushes apart
    constexpr double narrow_share = 0.4;  // of the smaller side's width: a shorter border is a neck
    constexpr double most_empty = 0.05;   // between two pieces of one convex thing: noise
    const auto of_a = points_of(a), of_b = points_of(b);
    const auto smaller = std::min(of_a.size(), of_b.size());
    if (static_cast<int>(smaller) < rule_.points) return true;
    double hold = 0, push = 0;
    std::vector<char> side(static_cast<std::size_t>(patches_.count), 0);
    for (int node : a) side[node] = 1;
    for (int node : b) side[node] = 2;
    for (const Bond& bond : bonds)
      if (side[bond.a] + side[bond.b] == 3) (bond.weight > 0 ? hold : push) += std::abs(bond.weight);
    const double width_m = std::sqrt(static_cast<double>(smaller)) * patches_.spacing_m;
    if (push <= groove_share * hold && hold >= narrow_share * width_m) return true;
    return sight_.emptiness_between(of_a, of_b, clear_m) < most_empty;
  };
  of_patch_ = multicut(patches_.count, bonds, may_join);
}

double PartGraph::Part::share_of(double height_m) const {
  return std::clamp((height_m - low_m) / std::max(1e-6, high_m - low_m), -1.0, 2.0);
}

PartGraph::Part PartGraph::part_of(const std::vector<int>& members) const {
  Part part;
  std::vector<double> heights;
  for (int i : members) {
    const Vec3& p = cloud_.points[cluster_[i]];
    part.points.push_back(p);
    part.seen.push_back(p - cloud_.sensor_origins.front());
    heights.push_back(table_.height_m(p));
  }
  const Flat flat = flat_of(part.seen);
  part.middle = flat.middle;
  part.normal = flat.normal;
  part.flat_m = flat.off_m;
  auto sorted = heights;
  std::sort(sorted.begin(), sorted.end());
  const std::size_t few = sorted.size() / 50;
  part.low_m = sorted[few];
  part.high_m = sorted[sorted.size() - 1 - few];
  part.hollow = sight_.emptiness_between(part.seen, part.seen, clear_m);
  int low = 0, bare = 0;
  for (std::size_t k = 0; k < heights.size(); ++k) {
    if (part.share_of(heights[k]) > 0.25) continue;
    ++low;
    bare += sight_.empty(part.seen[k] - (heights[k] - clear_m) * table_.normal, 0);
  }
  part.foot_seen = low > 0 ? static_cast<double>(bare) / low : 0;
  part.front = sight_.front_of(part.seen);
  const Turned turned = turned_about(part.seen, table_);
  part.turned_m = turned.off_m;
  part.axis_m = turned.axis_m;
  part.boxed_m = boxed_off_m(part.seen, table_);
  return part;
}

/// Near points of all pairs; of those that don't touch, the nearest of a thousand points each.
void PartGraph::find_contacts() {
  for (std::size_t i = 0; i < cluster_.size(); ++i)
    for (int j : near_[i]) {
      int a = of_patch_[patches_.of_point[i]], b = of_patch_[patches_.of_point[j]];
      if (a == b) continue;
      const Vec3 *p = &cloud_.points[cluster_[i]], *q = &cloud_.points[cluster_[j]];
      if (a > b) {
        std::swap(a, b);
        std::swap(p, q);
      }
      Contact& contact = contacts_[{a, b}];
      contact.of_first.push_back(*p);
      contact.of_second.push_back(*q);
    }
  constexpr std::size_t most = 1000;
  for (const auto& [a, of_a] : parts_)
    for (const auto& [b, of_b] : parts_) {
      if (b <= a || contacts_.contains({a, b})) continue;
      const Points &p = of_a.points, &q = of_b.points;
      Contact contact;
      double least2 = std::numeric_limits<double>::infinity();
      for (std::size_t i = 0; i < p.size(); i += std::max<std::size_t>(1, p.size() / most))
        for (std::size_t j = 0; j < q.size(); j += std::max<std::size_t>(1, q.size() / most))
          if (const double d2 = (p[i] - q[j]).squaredNorm(); d2 < least2) {
            least2 = d2;
            contact.gap_height_m = table_.height_m(p[i]);
          }
      contact.gap_m = std::sqrt(least2);
      contacts_.emplace(Pair{a, b}, contact);
    }
}

PartGraph::Touch PartGraph::touch_of(const Contact& contact) const {
  if (contact.of_first.empty()) return {contact.gap_height_m, 0};
  std::vector<double> heights;
  for (const auto* side : {&contact.of_first, &contact.of_second})
    for (const Vec3& p : *side) heights.push_back(table_.height_m(p));
  std::sort(heights.begin(), heights.end());
  const std::size_t quarter = heights.size() / 4;
  return {heights[heights.size() / 2], heights[heights.size() - 1 - quarter] - heights[quarter]};
}

PartGraph::Seam PartGraph::seam_of(const Pair& pair) const {
  const double tolerance_rad = rule_.concavity_deg * M_PI / 180;
  Seam seam;
  for (const Border& border : patches_.borders) {
    const int a = of_patch_[border.a], b = of_patch_[border.b];
    if (std::minmax(a, b) != std::minmax(pair.first, pair.second)) continue;
    seam.bond += bond_of(border, tolerance_rad);
    seam.crease_rad += border.hollow_rad * border.length_m;
    seam.length_m += border.length_m;
  }
  if (seam.length_m > 0) {
    seam.bond /= seam.length_m;
    seam.crease_rad /= seam.length_m;
  }
  return seam;
}

/// What share of all near points that a part has with others the contact has.
double PartGraph::hold_of(int name, const Contact& contact) const {
  std::size_t all = 0;
  for (const auto& [pair, other] : contacts_)
    if (pair.first == name || pair.second == name) all += other.of_first.size();
  return static_cast<double>(contact.of_first.size()) / static_cast<double>(std::max<std::size_t>(1, all));
}

/// Of a plane from the table; 0 of what has none.
double PartGraph::lean_of(const Vec3& normal) const {
  return normal.isZero() ? 0 : std::acos(std::clamp(std::abs(normal.dot(table_.normal)), 0.0, 1.0));
}

/// Lean and unevenness of what carries another part: points near to where they touch, walls below left out.
std::pair<double, double> PartGraph::carrier(const Part& under, const Points& touching,
                                             double height_m) const {
  constexpr double near_m = 0.015, below_m = 0.006;
  // A point has a place in the list for each of its neighbours; most of them follow each other.
  Points touched;
  std::unique_copy(touching.begin(), touching.end(), std::back_inserter(touched));
  Eigen::AlignedBox3d around;
  for (const Vec3& q : touched) around.extend(q);
  Points top;
  for (const Vec3& p : under.points)
    if (!touched.empty() && around.squaredExteriorDistance(p) < near_m * near_m &&
        table_.height_m(p) >= height_m - below_m &&
        std::any_of(touched.begin(), touched.end(),
                    [&](const Vec3& q) { return (p - q).squaredNorm() < near_m * near_m; }))
      top.push_back(p);
  const Flat flat = flat_of(top);
  if (flat.normal.isZero()) return {M_PI / 2, 0};
  return {std::acos(std::clamp(std::abs(flat.normal.dot(table_.normal)), 0.0, 1.0)),
          unevenness_m(top, flat.normal)};
}

std::vector<PartGraph::Pair> PartGraph::pairs() const {
  std::vector<Pair> list;
  for (const auto& [pair, contact] : contacts_)
    if (contact.gap_m < most_gap_m) list.push_back(pair);
  return list;
}

Evidence PartGraph::evidence(const Pair& pair) const {
  const Contact& contact = contacts_.at(pair);
  const bool turned = parts_.at(pair.first).points.size() > parts_.at(pair.second).points.size();
  const Part &a = parts_.at(turned ? pair.second : pair.first),
             &b = parts_.at(turned ? pair.first : pair.second);
  const Points &of_a = turned ? contact.of_second : contact.of_first,
               &of_b = turned ? contact.of_first : contact.of_second;
  const Touch touch = touch_of(contact);
  const Seam seam = seam_of(pair);
  const auto behind = [&](const Part& back, const Part& front) {
    return sight_.hidden_behind(back.seen, front.front, clear_m / 2) / static_cast<double>(back.seen.size());
  };
  const auto wide_m = [&](const Part& part) {
    return std::sqrt(static_cast<double>(part.points.size())) * patches_.spacing_m;
  };
  const auto [carrier_b_rad, carrier_b_off_m] = carrier(b, of_b, touch.middle_m);
  const auto [carrier_a_rad, carrier_a_off_m] = carrier(a, of_a, touch.middle_m);
  Points both = a.seen;
  both.insert(both.end(), b.seen.begin(), b.seen.end());
  const Vec3 way = b.middle - a.middle;
  const Flat flat_both = flat_of(both);
  const auto [shortest_m, longest_m] = widths_of(farther(a.foot, b.foot));
  const double normals_rad = std::acos(std::clamp(a.normal.dot(b.normal), -1.0, 1.0));
  return {
      // of the space between the two: sight.h
      {"empty", sight_.emptiness_between(a.seen, b.seen, clear_m)},
      // of the space within one
      {"hollow_a", a.hollow},
      {"hollow_b", b.hollow},
      // pairs of near points, by the root of a's points
      {"touching", static_cast<double>(of_a.size()) / std::sqrt(static_cast<double>(a.points.size()))},
      // 0 where they touch
      {"gap_m", contact.gap_m},
      // the touch's height within a: 0 its foot, 1 its top
      {"touch_in_a", a.share_of(touch.middle_m)},
      {"touch_in_b", b.share_of(touch.middle_m)},
      // quartiles of the touch's heights
      {"touch_spread_m", touch.spread_m},
      {"touch_height_m", touch.middle_m},
      // of the patches' borders: README.md
      {"bond", seam.bond},
      {"crease_rad", seam.crease_rad},
      {"border_m", seam.length_m},
      // share of a's points in b's convex hull
      {"a_in_b", share_inside(b.hull, round_, a.points)},
      {"b_in_a", share_inside(a.hull, round_, b.points)},
      // the same seen from above
      {"foot_a_in_b", share_inside(b.foot, level_, a.points)},
      {"foot_b_in_a", share_inside(a.foot, level_, b.points)},
      // a's top above b's
      {"tops_m", a.high_m - b.high_m},
      // a's foot above b's
      {"feet_m", a.low_m - b.low_m},
      {"foot_a_m", a.low_m},
      {"foot_b_m", b.low_m},
      {"tall_a_m", a.high_m - a.low_m},
      {"tall_b_m", b.high_m - b.low_m},
      // share of a's points seen beside nearer ones of b
      {"a_behind_b", behind(a, b)},
      {"b_behind_a", behind(b, a)},
      // root of the area
      {"wide_a_m", wide_m(a)},
      {"wide_b_m", wide_m(b)},
      // share of a's lowest points below which the table was seen
      {"foot_seen_a", a.foot_seen},
      {"foot_seen_b", b.foot_seen},
      // lean of b from the table where a touches it
      {"carrier_b_rad", carrier_b_rad},
      // and its deviation from a plane
      {"carrier_b_off_m", carrier_b_off_m},
      {"carrier_a_rad", carrier_a_rad},
      {"carrier_a_off_m", carrier_a_off_m},
      // middle of b farther from the sensor than a's
      {"depth_m", b.middle.norm() - a.middle.norm()},
      // of the middles, along the table
      {"apart_m", (way - way.dot(table_.normal) * table_.normal).norm()},
      // emptiness within the two as one
      {"hollow_both", sight_.emptiness_between(both, both, clear_m)},
      // deviation from a plane
      {"flat_a_m", a.flat_m},
      {"flat_b_m", b.flat_m},
      // of one's middle from the other's plane
      {"coplanar_m", std::max(std::abs(way.dot(a.normal)), std::abs(way.dot(b.normal)))},
      // turned.h
      {"turned_both_m", turned_about(both, table_).off_m},
      {"axes_apart_m", std::min(far_m, (a.axis_m - b.axis_m).norm())},
      {"turned_a_m", a.turned_m},
      {"turned_b_m", b.turned_m},
      // what share of all that touches a is b
      {"hold_a", hold_of(turned ? pair.second : pair.first, contact)},
      {"hold_b", hold_of(turned ? pair.first : pair.second, contact)},
      // of the planes through the points, from the table
      {"lean_a_rad", lean_of(a.normal)},
      {"lean_b_rad", lean_of(b.normal)},
      {"lean_both_rad", lean_of(flat_both.normal)},
      // between the planes; negative where they are hollow
      {"normals_rad", (b.normal - a.normal).dot(way) < 0 ? -normals_rad : normals_rad},
      {"flat_both_m", flat_both.off_m},
      // boxed.h
      {"boxed_both_m", boxed_off_m(both, table_)},
      {"boxed_a_m", a.boxed_m},
      {"boxed_b_m", b.boxed_m},
      // of the space between the two, behind something else
      {"hidden", sight_.hidden_between(a.seen, b.seen, a.front, b.front, clear_m)},
      // extents of the two as one
      {"tall_both_m", std::max(a.high_m, b.high_m) - std::min(a.low_m, b.low_m)},
      {"long_both_m", longest_m},
      {"slim_both_m", shortest_m},
  };
}

void PartGraph::join(const Pair& pair) {
  const auto [kept, gone] = pair;
  std::replace(of_patch_.begin(), of_patch_.end(), gone, kept);
  std::vector<int> members;
  for (std::size_t i = 0; i < cluster_.size(); ++i)
    if (of_patch_[patches_.of_point[i]] == kept) members.push_back(static_cast<int>(i));
  Part both = part_of(members);
  both.hull = farther(parts_.at(kept).hull, parts_.at(gone).hull);
  both.foot = farther(parts_.at(kept).foot, parts_.at(gone).foot);
  parts_.at(kept) = std::move(both);
  parts_.erase(gone);
  contacts_.erase(pair);
  for (const auto& [other, part] : parts_) {
    if (other == kept) continue;
    Contact lost = std::move(contacts_.at(std::minmax(other, gone)));
    contacts_.erase(std::minmax(other, gone));
    if ((other < gone) != (other < kept)) std::swap(lost.of_first, lost.of_second);
    Contact& contact = contacts_.at(std::minmax(other, kept));
    contact.of_first.insert(contact.of_first.end(), lost.of_first.begin(), lost.of_first.end());
    contact.of_second.insert(contact.of_second.end(), lost.of_second.begin(), lost.of_second.end());
    if (lost.gap_m < contact.gap_m) {
      contact.gap_m = lost.gap_m;
      contact.gap_height_m = lost.gap_height_m;
    }
  }
}

std::map<int, int> PartGraph::sizes() const {
  std::map<int, int> sizes;
  for (const auto& [name, part] : parts_) sizes.emplace(name, static_cast<int>(part.points.size()));
  return sizes;
}

std::map<int, std::vector<int>> PartGraph::parts() const {
  std::map<int, std::vector<int>> list;
  for (std::size_t i = 0; i < cluster_.size(); ++i)
    list[of_patch_[patches_.of_point[i]]].push_back(cluster_[i]);
  return list;
}

}  // namespace geocage::stages
