#include "stages/reconstruct/unseen.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <vector>

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

/// A view as an image of depths whose cells are about `step_m` wide at the object.
class DepthImage {
 public:
  using Cell = std::pair<int, int>;
  static constexpr std::array<Cell, 4> sides = {{{1, 0}, {-1, 0}, {0, 1}, {0, -1}}};

  /// Of the points of one view, or of all where `view` is -1.
  DepthImage(const PointCloud& seen, const Vec3& sensor, int view, double step_m) : sensor_(sensor) {
    Vec3 mean = Vec3::Zero();
    for (const Vec3& p : seen.points) mean += p / static_cast<double>(seen.size());
    frame_ = geometry::frame_from_z((mean - sensor_).normalized());
    cell_ = step_m / (mean - sensor_).norm();
    for (std::size_t i = 0; i < seen.size(); ++i) {
      if (view >= 0 && seen.view[i] != view) continue;
      const Vec3 q = in_image(seen.points[i]);
      if (q.z() <= 0.01 * (mean - sensor_).norm()) continue;  // beside or behind the sensor: not of this view
      const auto [it, fresh] = depth_.try_emplace(cell_of(q), q.z());
      it->second = std::min(it->second, q.z());
      deepest_ = std::max(deepest_, q.z());
    }
    for (int i = 0; i < 2; ++i) fill_specks();
  }

  const std::map<Cell, double>& depths() const { return depth_; }
  double deepest() const { return deepest_; }
  /// How far p lies behind what was seen in its direction, negative before it; nothing where nothing was.
  std::optional<double> behind(const Vec3& p) const {
    const Vec3 q = in_image(p);
    if (q.z() <= 0) return {};
    const auto it = depth_.find(cell_of(q));
    return it == depth_.end() ? std::nullopt : std::optional(q.z() - it->second);
  }
  Vec3 view() const { return frame_.col(2); }
  /// Where the middle of a cell lies at a depth.
  Vec3 at(const Cell& cell, double depth) const {
    return sensor_ + depth * (frame_ * Vec3(cell.first * cell_, cell.second * cell_, 1));
  }
  Vec3 sideways(const Cell& side) const { return frame_ * Vec3(side.first, side.second, 0); }

 private:
  Vec3 in_image(const Vec3& p) const { return frame_.transpose() * (p - sensor_); }
  Cell cell_of(const Vec3& q) const {
    return {static_cast<int>(std::lround(q.x() / q.z() / cell_)),
            static_cast<int>(std::lround(q.y() / q.z() / cell_))};
  }

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
  const DepthImage image(seen, seen.sensor_origins.front(), -1, step_m);
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

/// Space round the points in cells of `step_m`: free where a ray passed, hidden where all views saw
/// something nearer, but for one that may have seen nothing there (sensors have gaps), else open.
class SpaceOfViews {
 public:
  using Index = Eigen::Vector3i;
  enum State : char { open, free, hidden };

  SpaceOfViews(const PointCloud& seen, double step_m) : step_m_(step_m) {
    Vec3 high = seen.points.front();
    low_ = high;
    for (const Vec3& p : seen.points) {
      low_ = low_.cwiseMin(p);
      high = high.cwiseMax(p);
    }
    size_ = ((high - low_) / step_m).cast<int>() + Index::Ones();
    const auto cells = static_cast<std::size_t>(size_.cast<long>().prod());
    state_.resize(cells, open);
    near_.resize(cells, 0);
    for (const Vec3& p : seen.points)
      for_around(((p - low_) / step_m).cast<int>(), [&](const Index& at) { near_[number(at)] = 1; });
    std::vector<DepthImage> images;
    for (std::size_t v = 0; v < seen.sensor_origins.size(); ++v)
      images.emplace_back(seen, seen.sensor_origins[v], static_cast<int>(v), step_m);
    for_all([&](const Index& at) { state_[number(at)] = state_of(middle(at), images); });
  }

  const Index& size() const { return size_; }
  bool inside(const Index& at) const { return (at.array() >= 0).all() && (at.array() < size_.array()).all(); }
  State state(const Index& at) const { return inside(at) ? state_[number(at)] : open; }
  bool near_points(const Index& at) const { return near_[number(at)] != 0; }
  bool faces_free(const Index& at, const Index& step) const {
    return state(at + step) == free && !near_points(at + step);
  }
  Vec3 middle(const Index& at) const { return low_ + step_m_ * (at.cast<double>() + Vec3::Constant(0.5)); }
  /// From what is hidden around a cell to what is free.
  Vec3 outward(const Index& at) const {
    Vec3 sum = Vec3::Zero();
    for_around(at, [&](const Index& next) {
      const double sign = state(next) == free ? 1 : state(next) == hidden ? -1 : 0;
      sum += sign * (next - at).cast<double>();
    });
    return sum;
  }
  template <class Take>
  void for_all(Take take) const {
    for (int z = 0; z < size_.z(); ++z)
      for (int y = 0; y < size_.y(); ++y)
        for (int x = 0; x < size_.x(); ++x) take(Index(x, y, z));
  }

  template <class Take>
  void for_around(const Index& at, Take take) const {
    for (int z = -1; z <= 1; ++z)
      for (int y = -1; y <= 1; ++y)
        for (int x = -1; x <= 1; ++x)
          if (const Index next = at + Index(x, y, z); inside(next)) take(next);
  }

 private:
  std::size_t number(const Index& at) const {
    return (static_cast<std::size_t>(at.z()) * static_cast<std::size_t>(size_.y()) +
            static_cast<std::size_t>(at.y())) *
               static_cast<std::size_t>(size_.x()) +
           static_cast<std::size_t>(at.x());
  }
  /// Free ends three cells before a surface: noise, and the nearest of a cell's depths. Hidden is what all
  /// views but one saw something nearer than; one may have seen nothing there, as sensors have shadows.
  State state_of(const Vec3& p, const std::vector<DepthImage>& images) const {
    State state = hidden;
    int missed = 0;
    for (const DepthImage& image : images) {
      const auto behind = image.behind(p);
      if (behind && *behind < -3 * step_m_) return free;
      if (!behind) ++missed;
      if (missed > 1 || (behind && *behind < 0)) state = open;
    }
    return state;
  }

  double step_m_;
  Vec3 low_;
  Index size_;
  std::vector<State> state_;
  std::vector<char> near_;  ///< within a cell of a point
};

/// Hidden cells beside free ones, far from points, in groups that touch and have at least `least` cells.
std::vector<SpaceOfViews::Index> frontier_of(const SpaceOfViews& space, std::size_t least) {
  using Index = SpaceOfViews::Index;
  std::map<std::array<int, 3>, bool> taken;
  const auto key = [](const Index& at) { return std::array{at.x(), at.y(), at.z()}; };
  space.for_all([&](const Index& at) {
    if (space.state(at) != SpaceOfViews::hidden || space.near_points(at)) return;
    for (int axis = 0; axis < 3; ++axis)
      for (int side : {-1, 1})
        if (space.faces_free(at, side * Index::Unit(axis))) taken[key(at)] = false;
  });
  std::vector<Index> frontier;
  for (auto& [first, seen] : taken) {
    if (seen) continue;
    seen = true;
    std::vector<Index> group = {Index(first[0], first[1], first[2])};
    for (std::size_t k = 0; k < group.size(); ++k)
      space.for_around(Index(group[k]), [&](const Index& next) {
        const auto it = taken.find(key(next));
        if (it == taken.end() || it->second) return;
        it->second = true;
        group.push_back(next);
      });
    if (group.size() >= least) frontier.insert(frontier.end(), group.begin(), group.end());
  }
  return frontier;
}

/// Between what rays passed and what is hidden, where nothing was measured: a cup's inside below the last ray
/// that came over its rim (after Curless and Levoy 1996, section 4). A few cells alone are noise.
void close_hidden(const PointCloud& seen, double step_m, Adder& adder) {
  constexpr std::size_t least_cells = 20;
  const SpaceOfViews space(seen, step_m);
  for (const auto& at : frontier_of(space, least_cells))
    for (int axis = 0; axis < 3; ++axis)
      for (int side : {-1, 1}) {
        const SpaceOfViews::Index step = side * SpaceOfViews::Index::Unit(axis);
        const Vec3 outward = space.outward(at);
        if (!space.faces_free(at, step) || outward.dot(step.cast<double>()) <= 0) continue;
        adder.add((space.middle(at) + space.middle(at + step)) / 2, outward.normalized());
      }
}

}  // namespace

PointCloud closed_where_unseen(const PointCloud& cloud, double step_m, bool open_cavities) {
  PointCloud closed = cloud;
  Adder adder(closed, step_m);
  if (cloud.sensor_origins.size() == 1) {
    close_behind(cloud, step_m, adder);
    return closed;
  }
  if (open_cavities && !cloud.sensor_origins.empty() && cloud.view.size() == cloud.size())
    close_hidden(cloud, step_m, adder);
  if (cloud.support) close_below(cloud, *cloud.support, step_m, adder);
  return closed;
}

}  // namespace geocage::stages
