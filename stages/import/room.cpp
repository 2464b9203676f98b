#include "stages/import/room.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <optional>

#include "geometry/clusters.h"
#include "geometry/median.h"
#include "stages/import/outline.h"
#include "stages/import/sight.h"

namespace geocage::stages {

using geometry::Plane;
using geometry::PointCloud;
using geometry::Vec3;

namespace {

constexpr double cell_m = 0.01;
constexpr double hang_m = 0.02;        // cells farther apart don't hang together
constexpr double around_m = 0.3;       // as far from a table's outline is looked for what hangs over it
constexpr double begins_m = 0.03;      // what stands on a plane is seen this near to it
constexpr double thing_top_m2 = 0.15;  // a plane as large is no top of a thing
constexpr int most_planes = 8;
constexpr double noise_1pm = 0.006;  // depth errors grow with the square of the distance

/// A point a cell, the mean of those in it: as dense on the floor far away as on the table.
struct Cells {
  PointCloud cloud;
  std::vector<int> of_point, weight;
  std::vector<double> noise_m;  ///< how far from a plane its points may lie
  std::optional<Sight> sight;   ///< where the sensor's place is known

  explicit Cells(const PointCloud& fine, double least_m) : of_point(fine.size()) {
    if (!fine.sensor_origins.empty()) sight.emplace(sight_of(fine));
    std::vector<std::pair<std::array<int, 3>, int>> keys;
    for (std::size_t i = 0; i < fine.size(); ++i) {
      const Eigen::Vector3i key = (fine.points[i] / cell_m).array().floor().cast<int>();
      keys.push_back({{key.x(), key.y(), key.z()}, static_cast<int>(i)});
    }
    std::sort(keys.begin(), keys.end());
    for (std::size_t k = 0; k < keys.size(); ++k) {
      if (k == 0 || keys[k].first != keys[k - 1].first) {
        cloud.points.push_back(Vec3::Zero());
        weight.push_back(0);
      }
      cloud.points.back() += fine.points[keys[k].second];
      ++weight.back();
      of_point[keys[k].second] = static_cast<int>(weight.size()) - 1;
    }
    for (std::size_t c = 0; c < weight.size(); ++c) cloud.points[c] /= weight[c];
    cloud.sensor_origins = fine.sensor_origins;
    for (const Vec3& p : cloud.points) noise_m.push_back(std::max(least_m, sensor_noise_m(p)));
  }
  double sensor_noise_m(const Vec3& p) const { return noise_1pm * (p - sensor()).squaredNorm(); }
  Vec3 sensor() const {
    return cloud.sensor_origins.empty() ? Vec3::Zero().eval() : cloud.sensor_origins.front();
  }
  bool on(const Plane& plane, std::size_t c, double times = 1) const {
    return std::abs(plane.height_m(cloud.points[c])) <= times * noise_m[c];
  }
};

/// The largest first, each of what the others have left.
std::vector<Plane> planes_of(const Cells& cells, const TableRule& rule) {
  std::vector<Plane> planes;
  std::vector<int> left(cells.weight.size());
  std::iota(left.begin(), left.end(), 0);
  const std::size_t least = std::max<std::size_t>(500, left.size() / 50);
  while (planes.size() < most_planes && left.size() >= least) {
    const auto found = find_plane(geometry::subset(cells.cloud, left), rule.plane_tolerance_m, rule.seed);
    if (found.on.size() < least) break;
    planes.push_back(found.plane);
    std::erase_if(left, [&](int c) { return cells.on(found.plane, static_cast<std::size_t>(c), 1.5); });
  }
  return planes;
}

/// A plane taken for the table.
struct Taken {
  Plane plane;
  std::vector<int> own;                    ///< cells on it, where it meets no other plane
  std::vector<char> background, standing;  ///< of each cell
  bool has_background = false;
  double carried = 0;  ///< points that stand on it
  double away_m = 0;   ///< of its cells from the sensor, median
  Vec3 middle = Vec3::Zero();
};

std::vector<Vec3> points_of(const PointCloud& cells, const std::vector<int>& chosen) {
  std::vector<Vec3> points;
  for (int c : chosen) points.push_back(cells.points[c]);
  return points;
}

/// Those in its large pieces: things and their shadows part a table, crumbs are something else.
std::vector<int> large_pieces(const PointCloud& cells, const std::vector<int>& chosen) {
  constexpr double least_share = 0.05;  // of the largest
  const auto pieces = geometry::clusters(points_of(cells, chosen), 1.5 * hang_m);
  std::size_t largest = 0;
  for (const auto& piece : pieces) largest = std::max(largest, piece.size());
  std::vector<int> kept;
  for (const auto& piece : pieces)
    if (static_cast<double>(piece.size()) >= least_share * static_cast<double>(largest))
      for (int i : piece) kept.push_back(chosen[i]);
  return kept;
}

/// Whether what begins high over a plane carries itself, as a shelf does: below its border on the sensor's
/// side, that far up, most is seen to be empty. What stands behind something else hides there.
bool hangs_free(const Cells& cells, const Plane& plane, const std::vector<int>& chosen) {
  if (!cells.sight) return false;
  constexpr double border = 0.2;  // of the cells
  const Vec3 sensor = cells.sensor();
  std::vector<std::pair<double, int>> by_distance;
  for (int c : chosen) {
    const Vec3 to = cells.cloud.points[c] - sensor;
    by_distance.emplace_back((to - to.dot(plane.normal) * plane.normal).norm(), c);
  }
  std::sort(by_distance.begin(), by_distance.end());
  by_distance.resize(static_cast<std::size_t>(std::ceil(border * static_cast<double>(by_distance.size()))));
  int all = 0, empty = 0;
  for (const auto& [distance, c] : by_distance) {
    const Vec3& p = cells.cloud.points[c];
    const double behind_m = std::max(clear_m, 2 * cells.sensor_noise_m(p));
    for (double down_m = 2 * cell_m; down_m < plane.height_m(p) - cell_m; down_m += cell_m, ++all)
      empty += cells.sight->empty(p - down_m * plane.normal - sensor, behind_m);
  }
  return 2 * empty > all;
}

Taken take(const Cells& cells, const std::vector<Plane>& planes, std::size_t which, const TableRule& rule) {
  const PointCloud& cloud = cells.cloud;
  const std::size_t n = cloud.size();
  Taken taken{planes[which], {}, std::vector<char>(n), std::vector<char>(n)};
  for (std::size_t c = 0; c < n; ++c) {  // where it meets another plane, that may have gone on beside it
    bool alone = cells.on(taken.plane, c);
    for (std::size_t k = 0; k < planes.size() && alone; ++k)
      alone = k == which || !cells.on(planes[k], c, 1.5);
    if (alone) taken.own.push_back(static_cast<int>(c));
  }
  taken.own = large_pieces(cloud, taken.own);
  if (taken.own.empty()) return taken;
  const auto piece = points_of(cloud, taken.own);
  const Outline outline(taken.plane, piece);
  const auto over = [&](std::size_t c) {
    const double height = taken.plane.height_m(cloud.points[c]);
    return height > 0 && height <= rule.above_max_m && !cells.on(taken.plane, c) &&
           outline.holds(cloud.points[c]);
  };
  for (std::size_t k = 0; k < planes.size(); ++k) {
    if (k == which) continue;
    std::size_t all = 0, inside = 0;
    for (std::size_t c = 0; c < n; ++c) {
      if (!cells.on(planes[k], c) || cells.on(taken.plane, c)) continue;
      ++all;
      inside += over(c);
    }
    if (2 * inside >= all) continue;
    taken.has_background = true;
    for (std::size_t c = 0; c < n; ++c)
      if (cells.on(planes[k], c, 1.5)) taken.background[c] = 1;
  }
  std::vector<double> away_m;
  for (const Vec3& p : piece) {
    taken.middle += p / static_cast<double>(piece.size());
    away_m.push_back((p - cells.sensor()).norm());
  }
  taken.away_m = geometry::median(away_m);

  std::vector<int> near;
  for (std::size_t c = 0; c < n; ++c) {
    const double height = taken.plane.height_m(cloud.points[c]);
    if (!taken.background[c] && !cells.on(taken.plane, c) && height > 0 &&
        height <= rule.above_max_m + around_m && outline.holds(cloud.points[c], around_m))
      near.push_back(static_cast<int>(c));
  }
  for (const auto& one : geometry::clusters(points_of(cloud, near), hang_m)) {
    double inside = 0, all = 0, lowest_m = rule.above_max_m;
    bool is_flat = cells.sight.has_value();  // no higher than the sensor errs
    std::vector<int> held;
    for (int i : one) {
      const auto c = static_cast<std::size_t>(near[i]);
      all += cells.weight[c];
      if (!over(c)) continue;
      const double height_m = taken.plane.height_m(cloud.points[c]);
      inside += cells.weight[c];
      held.push_back(near[i]);
      lowest_m = std::min(lowest_m, height_m);
      is_flat = is_flat && height_m < 2 * cells.sensor_noise_m(cloud.points[c]);
    }
    if (2 * inside < all || is_flat) continue;
    const bool begins_high = lowest_m > rule.above_min_m + begins_m;
    if (begins_high && hangs_free(cells, taken.plane, held)) continue;
    for (int c : held) taken.standing[c] = 1;
    if (inside >= rule.points && !begins_high) taken.carried += inside;
  }
  return taken;
}

/// Whether a plane is the top of things that stand on another one.
bool is_top_of_thing(const Taken& top, const Taken& below) {
  std::size_t standing = 0;
  for (int c : top.own) standing += static_cast<std::size_t>(below.standing[c]);
  return 2 * standing > top.own.size() &&
         static_cast<double>(top.own.size()) * cell_m * cell_m < thing_top_m2;
}

}  // namespace

std::optional<FoundTable> table_in_room(const PointCloud& cloud, const FoundPlane& largest,
                                        const TableRule& rule) {
  const Cells cells(cloud, rule.plane_tolerance_m);
  const auto planes = planes_of(cells, rule);
  std::vector<Taken> carrying;
  for (std::size_t k = 0; k < planes.size(); ++k)
    if (auto taken = take(cells, planes, k, rule); taken.carried > 0) carrying.push_back(std::move(taken));
  const Taken* table = nullptr;
  for (const Taken& one : carrying) {
    const bool is_top = std::any_of(carrying.begin(), carrying.end(),
                                    [&](const Taken& below) { return is_top_of_thing(one, below); });
    if (!is_top && (table == nullptr || one.away_m < table->away_m)) table = &one;
  }
  if (table == nullptr) return {};
  const bool same = table->plane.normal.dot(largest.plane.normal) > 0.999 &&
                    std::abs(largest.plane.height_m(table->middle)) < rule.plane_tolerance_m;
  if (same && !table->has_background) return {};
  FoundTable found;
  found.in_room = true;
  found.table.plane = table->plane;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const auto cell = static_cast<std::size_t>(cells.of_point[i]);
    const double height = table->plane.height_m(cloud.points[i]);
    if (std::abs(height) <= rule.plane_tolerance_m && !table->background[cell])
      found.table.on.push_back(static_cast<int>(i));
    else if (height >= rule.above_min_m && table->standing[cell])
      found.standing.push_back(static_cast<int>(i));
  }
  return found;
}

}  // namespace geocage::stages
