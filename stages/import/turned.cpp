#include "stages/import/turned.h"

#include <cmath>
#include <limits>
#include <map>

namespace geocage::stages {

using Eigen::Vector2d;
using geometry::Vec3;

namespace {

/// Points by their feet, in slices of height.
struct Slices {
  std::vector<Vector2d> foot;
  std::vector<int> of_point;
  std::vector<double> size;
};

Slices slices_of(const std::vector<Vec3>& seen, const geometry::Plane& table) {
  constexpr std::size_t most = 600;
  constexpr double slice_m = 0.006;
  const Eigen::Matrix3d frame = geometry::frame_from_z(table.normal);
  Slices slices;
  std::map<int, int> number;
  const std::size_t step = std::max<std::size_t>(1, seen.size() / most);
  for (std::size_t i = 0; i < seen.size(); i += step) {
    const Vec3 q = frame.transpose() * seen[i];
    slices.foot.emplace_back(q.x(), q.y());
    const int at = static_cast<int>(std::floor(q.z() / slice_m));
    slices.of_point.push_back(number.emplace(at, static_cast<int>(number.size())).first->second);
  }
  slices.size.assign(number.size(), 0);
  for (int s : slices.of_point) ++slices.size[s];
  return slices;
}

/// The squares' sum at an axis, and the step that Gauss-Newton takes from there.
std::pair<double, Vector2d> step_from(const Slices& slices, const Vector2d& axis) {
  const std::size_t n = slices.foot.size();
  std::vector<double> radius(n), mean(slices.size.size(), 0);
  std::vector<Vector2d> way(n), mean_way(slices.size.size(), Vector2d::Zero());
  for (std::size_t i = 0; i < n; ++i) {
    const int s = slices.of_point[i];
    way[i] = axis - slices.foot[i];
    radius[i] = std::max(1e-6, way[i].norm());
    way[i] /= radius[i];
    mean[s] += radius[i] / slices.size[s];
    mean_way[s] += way[i] / slices.size[s];
  }
  Eigen::Matrix2d H = 1e-6 * static_cast<double>(n) * Eigen::Matrix2d::Identity();
  Vector2d g = Vector2d::Zero();
  double squares = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const int s = slices.of_point[i];
    const double off = radius[i] - mean[s];
    const Vector2d J = way[i] - mean_way[s];
    H += J * J.transpose();
    g += off * J;
    squares += off * off;
  }
  return {squares, -H.ldlt().solve(g)};
}

}  // namespace

Turned turned_about(const std::vector<Vec3>& seen, const geometry::Plane& table) {
  constexpr int rounds = 12;
  constexpr double behind_m = 0.03, most_m = 0.02, still_m = 1e-5;
  const Slices slices = slices_of(seen, table);
  Vector2d middle = Vector2d::Zero();
  for (const Vector2d& p : slices.foot) middle += p / static_cast<double>(slices.foot.size());
  Vector2d axis = middle + behind_m * middle.normalized();
  Turned best{axis, std::numeric_limits<double>::infinity()};
  for (int round = 0; round < rounds; ++round) {
    auto [squares, step] = step_from(slices, axis);
    const double off_m = std::sqrt(squares / static_cast<double>(slices.foot.size()));
    if (off_m < best.off_m) best = {axis, off_m};
    if (step.norm() < still_m) break;
    axis += std::min(1.0, most_m / step.norm()) * step;
  }
  return best;
}

}  // namespace geocage::stages
