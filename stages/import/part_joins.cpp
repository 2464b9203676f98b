#include "stages/import/part_joins.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Eigenvalues>

#include "geometry/depth_camera.h"
#include "geometry/median.h"

namespace geocage::stages {

using geometry::Vec3;

namespace {

constexpr double convex_empty = 0.02;   // of the space between two parts: noise
constexpr double hollow_empty = 0.06;   // of the space between a part's own points: an inside
constexpr double hidden_share = 0.04;   // of its points are seen beside something nearer
constexpr double most_inside = 0.5;     // of its points in the other's hull
constexpr double standing_m = 0.03;     // lower than that, or than
constexpr double standing_share = 0.4;  // of its height, it stands on the table
constexpr double resting_share = 0.35;  // contacts in the lowest third of a thing carry it
constexpr double level_m = 0.008;       // what carries a thing is level to this
constexpr double level_rad = 0.4;       // and not steeper than this (23 degrees)
constexpr double flat_m = 0.0017;    // and flat to this, as a Kinect's planes; a neck's shoulders fall away,
constexpr double beside_m = 0.003;   // by no more than this; what is more uneven rises beside the thing
constexpr int least_flat = 40;       // points that tell so
constexpr double shared_foot = 0.2;  // two things can't stand in one place

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

/// Normal of the plane fitted to points; zero of too few.
Vec3 normal_of(const std::vector<Vec3>& points) {
  if (points.size() < 8) return Vec3::Zero();
  Vec3 middle = Vec3::Zero();
  for (const Vec3& p : points) middle += p;
  middle /= static_cast<double>(points.size());
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const Vec3& p : points) scatter += (p - middle) * (p - middle).transpose();
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(scatter).eigenvectors().col(0);
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

int most_touched(const std::map<int, int>& sides) {
  const auto less = [](const auto& a, const auto& b) { return a.second < b.second; };
  return std::max_element(sides.begin(), sides.end(), less)->first;
}

}  // namespace

/// `home(name, neighbours)` tells which part a part belongs to; itself where it stays.
template <class Home>
void PartJoins::join_while(const Home& home) {
  for (bool joined = true; joined;) {
    joined = false;
    for (const auto& [name, sides] : contacts()) {
      const int to = home(name, sides);
      if (to == name) continue;
      rename(name, to);
      joined = true;
      break;
    }
  }
}

void PartJoins::join_fragments(int most_points) {
  for (;;) {
    const auto size = sizes();
    const auto touch = contacts();
    int fragment = -1;
    for (const auto& [name, count] : size)
      if (count < most_points && touch.contains(name) && (fragment < 0 || count < size.at(fragment)))
        fragment = name;
    if (fragment < 0) return;
    rename(fragment, most_touched(touch.at(fragment)));
  }
}

void PartJoins::join_what_is_convex() {
  join_while([&](int name, const Sides& sides) {
    for (const auto& [other, pairs] : sides)
      if (emptiness(name, other) < convex_empty) return other;
    return name;
  });
}

void PartJoins::join_insides() {
  std::map<int, int> home;
  for (const auto& [name, sides] : contacts()) {
    if (emptiness(name, name) < hollow_empty) continue;
    const auto mine = seen_points_of(name);
    auto most = static_cast<int>(hidden_share * static_cast<double>(mine.size()));
    for (const auto& [other, pairs] : sides) {
      const int hidden = sight_.hidden_behind(mine, seen_points_of(other), clear_m / 2);
      if (hidden <= most || home.contains(other)) continue;  // an inside is in no other inside
      if (std::abs(reach_of(name).high_m - reach_of(other).high_m) > level_m)
        continue;  // both end at the rim
      most = hidden;
      home[name] = other;
    }
  }
  for (const auto& [name, other] : home) rename(name, other);
}

void PartJoins::join_what_lies_inside() {
  join_while([&](int name, const Sides& sides) {
    for (const auto& [other, pairs] : sides)
      if (Outline(points_of(other), all_round()).share_inside(points_of(name)) > most_inside) return other;
    return name;
  });
}

void PartJoins::join_what_has_no_stand() {
  join_what_floats();
  join_while([&](int name, const Sides& sides) { return home_of(name, sides); });
}

/// What touches nothing and doesn't stand is a piece of the nearest part: something hides where they meet.
/// Where the table below it is hidden, it may stand there.
void PartJoins::join_what_floats() {
  const auto touch = contacts();
  for (const auto& [name, count] : sizes()) {
    if (touch.contains(name) || stands(reach_of(name)) || hides_its_foot(name)) continue;
    const auto mine = points_of(name);
    double least = std::numeric_limits<double>::infinity();
    int home = name;
    for (const auto& [other, others] : sizes()) {
      if (other == name || others < count) continue;
      for (const Vec3& q : points_of(other))
        for (const Vec3& p : mine)
          if (const double d = (q - p).squaredNorm(); d < least) {
            least = d;
            home = other;
          }
    }
    rename(name, home);
  }
}

void PartJoins::join_strays(int least_points) {
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

/// The part that a part belongs to: itself where it has a stand of its own.
int PartJoins::home_of(int name, const Sides& sides) const {
  const Reach reach = reach_of(name);
  const bool rests =
      std::any_of(sides.begin(), sides.end(), [&](const auto& side) { return rests_on(name, side.first); });
  if (rests && reach.low_m > standing_m) return name;
  if (!rests && !stands(reach)) return most_touched(sides);
  for (const auto& [other, pairs] : sides)
    if (!rests_on(other, name) && !rests_on(name, other) && end_alike(name, other) &&
        Outline(points_of(other), along_table(table_)).share_inside(points_of(name)) > shared_foot)
      return other;
  return name;
}

/// True where the table below at least half of a part's lowest points wasn't seen.
bool PartJoins::hides_its_foot(int name) const {
  const Reach reach = reach_of(name);
  int low = 0, seen = 0;
  for (const Vec3& p : points_of(name)) {
    const double height_m = table_.height_m(p);
    if (reach.share_of(height_m) > 0.25) continue;
    const Vec3 foot = p - (height_m - clear_m) * table_.normal;
    ++low;
    seen += sight_.empty(foot - cloud_.sensor_origins.front(), 0);
  }
  return 2 * seen < low;
}

/// True of two parts that end at one height, as a rim's near and far walls do, or where one ends and the
/// other begins, as a neck's two sides do.
bool PartJoins::end_alike(int name, int other) const {
  const Reach a = reach_of(name), b = reach_of(other);
  const double middle_m = contact_of(name, other).middle_m;
  const auto near = [](double x, double y) { return std::abs(x - y) < level_m; };
  return near(a.high_m, b.high_m) || (near(a.high_m, middle_m) && near(b.low_m, middle_m)) ||
         (near(b.high_m, middle_m) && near(a.low_m, middle_m));
}

bool PartJoins::rests_on(int name, int other) const {
  const Contact contact = contact_of(name, other);
  if (contact.spread_m >= level_m || reach_of(name).share_of(contact.middle_m) >= resting_share) return false;
  const Carrier carrier = carrier_of(name, other, contact.middle_m);
  return carrier.tilt_rad < level_rad && (carrier.uneven_m < flat_m || carrier.uneven_m > beside_m);
}

/// What carries a part: points of `other` near to where they touch, its walls below left out.
PartJoins::Carrier PartJoins::carrier_of(int name, int other, double height_m) const {
  constexpr double near_m = 0.015, below_m = 0.006;
  std::vector<Vec3> touching, under;
  for (std::size_t i = 0; i < name_.size(); ++i)
    for (int j : near_[i]) {
      if (name_[i] == name && name_[j] == other) touching.push_back(cloud_.points[cluster_[j]]);
      if (name_[i] == other && name_[j] == name) touching.push_back(cloud_.points[cluster_[i]]);
    }
  for (const Vec3& p : points_of(other))
    if (table_.height_m(p) >= height_m - below_m &&
        std::any_of(touching.begin(), touching.end(),
                    [&](const Vec3& q) { return (p - q).squaredNorm() < near_m * near_m; }))
      under.push_back(p);
  const Vec3 normal = normal_of(under);
  if (normal.isZero()) return {M_PI / 2, flat_m};
  return {std::acos(std::clamp(std::abs(normal.dot(table_.normal)), 0.0, 1.0)),
          static_cast<int>(under.size()) < least_flat ? flat_m : unevenness_m(under, normal)};
}

PartJoins::Contact PartJoins::contact_of(int name, int other) const {
  std::vector<double> heights;
  for (std::size_t i = 0; i < name_.size(); ++i)
    for (int j : near_[i])
      if ((name_[i] == name && name_[j] == other) || (name_[i] == other && name_[j] == name))
        heights.push_back(table_.height_m(cloud_.points[cluster_[i]]));
  std::sort(heights.begin(), heights.end());
  const std::size_t quarter = heights.size() / 4;
  return {heights[heights.size() / 2], heights[heights.size() - 1 - quarter] - heights[quarter]};
}

double PartJoins::Reach::share_of(double height_m) const {
  return (height_m - low_m) / std::max(1e-6, high_m - low_m);
}

PartJoins::Reach PartJoins::reach_of(int name) const {
  std::vector<double> heights;
  for (const Vec3& p : points_of(name)) heights.push_back(table_.height_m(p));
  std::sort(heights.begin(), heights.end());
  const std::size_t few = heights.size() / 50;
  return {heights[few], heights[heights.size() - 1 - few]};
}

bool PartJoins::stands(const Reach& reach) const {
  return reach.low_m <= std::max(standing_m, standing_share * reach.high_m);
}

double PartJoins::emptiness(int name, int other) const {
  return sight_.emptiness_between(seen_points_of(name), seen_points_of(other), clear_m);
}

std::map<int, int> PartJoins::sizes() const {
  std::map<int, int> count;
  for (int name : name_) ++count[name];
  return count;
}

std::map<int, PartJoins::Sides> PartJoins::contacts() const {
  std::map<int, Sides> pairs;
  for (std::size_t i = 0; i < name_.size(); ++i)
    for (int j : near_[i])
      if (name_[i] != name_[j]) {
        ++pairs[name_[i]][name_[j]];
        ++pairs[name_[j]][name_[i]];
      }
  return pairs;
}

void PartJoins::rename(int from, int to) {
  std::replace(name_.begin(), name_.end(), from, to);
}

std::vector<Vec3> PartJoins::points_of(int name) const {
  std::vector<Vec3> points;
  for (std::size_t i = 0; i < name_.size(); ++i)
    if (name_[i] == name) points.push_back(cloud_.points[cluster_[i]]);
  return points;
}

std::vector<Vec3> PartJoins::seen_points_of(int name) const {
  auto points = points_of(name);
  for (Vec3& p : points) p -= cloud_.sensor_origins.front();
  return points;
}

std::vector<std::vector<int>> PartJoins::indices() const {
  std::map<int, std::vector<int>> parts;
  for (std::size_t i = 0; i < cluster_.size(); ++i) parts[name_[i]].push_back(cluster_[i]);
  std::vector<std::vector<int>> list;
  list.reserve(parts.size());
  for (auto& [name, part] : parts) list.push_back(std::move(part));
  return list;
}

}  // namespace geocage::stages
