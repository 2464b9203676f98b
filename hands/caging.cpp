#include "hands/caging.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

namespace geocage::hands {

namespace {

constexpr double depth_m = 0.0005;  // what counts as running into the object; more than closing leaves
constexpr double smallest_step_m = 0.001, cheap_step_m = 0.004,
                 largest_step_m = 0.02;  // the field is too large beyond its free border

}  // namespace

std::vector<Vec3> sphere_directions(int splits) {
  const double golden = 0.5 * (1 + std::sqrt(5.0));
  std::vector<Vec3> points;
  for (double one : {-1.0, 1.0})
    for (double far : {-golden, golden})
      for (int axis = 0; axis < 3; ++axis) {
        Vec3 p = Vec3::Zero();
        p[axis] = one;
        p[(axis + 1) % 3] = far;
        points.push_back(p.normalized());
      }
  std::vector<std::array<int, 3>> faces;
  const double edge = 2 / std::sqrt(1 + golden * golden);
  const auto joined = [&](int i, int j) { return (points[i] - points[j]).norm() < 1.01 * edge; };
  for (int i = 0; i < 12; ++i)
    for (int j = i + 1; j < 12; ++j)
      for (int k = j + 1; k < 12; ++k)
        if (joined(i, j) && joined(j, k) && joined(i, k)) faces.push_back({i, j, k});
  for (int split = 0; split < splits; ++split) {
    std::map<std::pair<int, int>, int> middles;
    const auto middle = [&](int i, int j) {
      const auto [entry, added] = middles.try_emplace(std::minmax(i, j), static_cast<int>(points.size()));
      if (added) points.push_back((points[i] + points[j]).normalized());
      return entry->second;
    };
    std::vector<std::array<int, 3>> finer;
    for (const auto& [i, j, k] : faces) {
      const int a = middle(i, j), b = middle(j, k), c = middle(k, i);
      finer.insert(finer.end(), {{i, a, c}, {a, j, b}, {c, b, k}, {a, b, c}});
    }
    faces = std::move(finer);
  }
  return points;
}

std::optional<double> free_travel_m(const geometry::SignedDistanceField& field,
                                    const std::vector<PlacedCapsule>& capsules_O, const Vec3& way_O,
                                    double travel_m) {
  std::optional<double> first;
  for (const PlacedCapsule& start : capsules_O) {
    for (double moved = 0;;) {
      const PlacedCapsule capsule{start.a + moved * way_O, start.b + moved * way_O, start.radius_m};
      double free_m = depth_m + capsule_distance_bound_m(field, capsule);
      if (free_m < cheap_step_m) free_m = depth_m + capsule_distance(field, capsule).distance_m;
      if (free_m < 0) first = travel_m = moved;
      if (moved >= travel_m) break;
      moved = std::min(travel_m, moved + std::clamp(free_m, smallest_step_m, largest_step_m));
    }
  }
  return first;
}

double blocked_share(const geometry::SignedDistanceField& field, const std::vector<PlacedCapsule>& capsules_O,
                     double travel_m) {
  static const std::vector<Vec3> directions = sphere_directions(1);
  const auto blocked = [&](const Vec3& direction) {  // the hand moves instead of the object
    return std::any_of(capsules_O.begin(), capsules_O.end(), [&](const PlacedCapsule& capsule) {
      return free_travel_m(field, {capsule}, -direction, travel_m).has_value();
    });
  };
  return static_cast<double>(std::count_if(directions.begin(), directions.end(), blocked)) /
         static_cast<double>(directions.size());
}

double closure_margin(const std::vector<Contact>& contacts) {
  static const std::vector<Vec3> directions = sphere_directions(2);
  double margin = 1;
  for (const Vec3& direction : directions) {
    double most = -1;
    for (const Contact& contact : contacts) most = std::max(most, contact.n_O.dot(direction));
    margin = std::min(margin, most);
  }
  return margin;
}

}  // namespace geocage::hands
