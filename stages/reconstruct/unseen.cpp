#include "stages/reconstruct/unseen.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>

namespace geocage::stages {

using geometry::PointCloud;
using geometry::Vec3;

namespace {

/// Adds points no nearer than about `step_m` to each other.
class Adder {
 public:
  Adder(PointCloud& cloud, double step_m) : cloud_(cloud), step_m_(step_m) {}
  void add(const Vec3& p, const Vec3& normal) {
    std::array<long, 3> cell;
    for (int k = 0; k < 3; ++k) cell[k] = std::lround(p[k] / step_m_);
    if (!taken_.insert(cell).second) return;
    cloud_.points.push_back(p);
    cloud_.normals.push_back(normal);
  }

 private:
  PointCloud& cloud_;
  const double step_m_;
  std::set<std::array<long, 3>> taken_;
};

/// At the table, wherever a row of the footprint has points on both sides.
void close_below(const PointCloud& seen, const geometry::Plane& table, double step_m, Adder& adder) {
  const Eigen::Matrix3d frame = geometry::frame_from_z(table.normal);
  std::map<long, std::pair<long, long>> rows;  // v -> smallest and largest u
  for (const Vec3& p : seen.points) {
    const long u = std::lround(frame.col(0).dot(p) / step_m), v = std::lround(frame.col(1).dot(p) / step_m);
    const auto [it, fresh] = rows.try_emplace(v, u, u);
    it->second = {std::min(it->second.first, u), std::max(it->second.second, u)};
  }
  for (const auto& [v, range] : rows)
    for (long u = range.first; u <= range.second; ++u)
      adder.add(
          frame * Vec3(static_cast<double>(u) * step_m, static_cast<double>(v) * step_m, table.offset_m),
          -table.normal);
}

/// A single view as an image of depths whose cells are about `step_m` wide at the object.
class DepthImage {
 public:
  using Cell = std::pair<int, int>;
  static constexpr std::array<Cell, 4> sides = {{{1, 0}, {-1, 0}, {0, 1}, {0, -1}}};

  DepthImage(const PointCloud& seen, double step_m) : sensor_(seen.sensor_origins.front()) {
    Vec3 mean = Vec3::Zero();
    for (const Vec3& p : seen.points) mean += p / static_cast<double>(seen.size());
    frame_ = geometry::frame_from_z((mean - sensor_).normalized());
    cell_ = step_m / (mean - sensor_).norm();
    for (const Vec3& p : seen.points) {
      const Vec3 q = frame_.transpose() * (p - sensor_);
      if (q.z() <= 0.01 * (mean - sensor_).norm()) continue;  // beside or behind the sensor: not of this view
      const Cell cell(static_cast<int>(std::lround(q.x() / q.z() / cell_)),
                      static_cast<int>(std::lround(q.y() / q.z() / cell_)));
      const auto [it, fresh] = depth_.try_emplace(cell, q.z());
      it->second = std::min(it->second, q.z());
      deepest_ = std::max(deepest_, q.z());
    }
    for (int i = 0; i < 2; ++i) fill_specks();
  }

  const std::map<Cell, double>& depths() const { return depth_; }
  double deepest() const { return deepest_; }
  Vec3 view() const { return frame_.col(2); }
  /// Where the middle of a cell lies at a depth.
  Vec3 at(const Cell& cell, double depth) const {
    return sensor_ + depth * (frame_ * Vec3(cell.first * cell_, cell.second * cell_, 1));
  }
  Vec3 sideways(const Cell& side) const { return frame_ * Vec3(side.first, side.second, 0); }

 private:
  /// Cells without a point among mostly seen ones are gaps of the sensor, not of the object.
  void fill_specks() {
    std::map<Cell, std::pair<double, int>> around;
    for (const auto& [cell, depth] : depth_)
      for (const auto& side : sides) {
        const Cell next(cell.first + side.first, cell.second + side.second);
        if (depth_.contains(next)) continue;
        around[next].first += depth;
        ++around[next].second;
      }
    for (const auto& [cell, sum] : around)
      if (sum.second >= 3) depth_[cell] = sum.first / sum.second;
  }

  Vec3 sensor_;
  Eigen::Matrix3d frame_;  ///< x and y across, z along the view
  double cell_ = 0, deepest_ = 0;
  std::map<Cell, double> depth_;
};

/// The rest of the border of what a single view could not see: behind each seen cell, at the farthest seen
/// depth or at the table, and between cells where the depth jumps or the object ends.
void close_behind(const PointCloud& seen, double step_m, Adder& adder) {
  const DepthImage image(seen, step_m);
  for (const auto& [cell, depth] : image.depths()) {
    double end = image.deepest() + step_m;
    Vec3 facing = image.view();
    if (seen.support) {
      const double near = seen.support->height_m(image.at(cell, 0)),
                   far = seen.support->height_m(image.at(cell, end));
      if (near > 0 && far < 0) {
        end *= near / (near - far);
        facing = -seen.support->normal;
      }
    }
    if (end > depth + 2 * step_m) adder.add(image.at(cell, end), facing);
    for (const auto& side : DepthImage::sides) {
      const auto next = image.depths().find({cell.first + side.first, cell.second + side.second});
      const double until = next == image.depths().end() ? end : std::min(end, next->second);
      for (double d = depth + 2 * step_m; d < until - step_m; d += step_m)
        adder.add(image.at(cell, d), image.sideways(side));
    }
  }
}

}  // namespace

PointCloud closed_where_unseen(const PointCloud& cloud, double step_m) {
  PointCloud closed = cloud;
  Adder adder(closed, step_m);
  if (cloud.sensor_origins.size() == 1)
    close_behind(cloud, step_m, adder);
  else if (cloud.support)
    close_below(cloud, *cloud.support, step_m, adder);
  return closed;
}

}  // namespace geocage::stages
