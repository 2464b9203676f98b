#include "stages/import/sight.h"

#include <algorithm>
#include <cmath>

namespace geocage::stages {

using geometry::Vec3;

namespace {
constexpr double cell_rad = 0.0025;  // 2 mm at 0.8 m: a pixel and a half of a Kinect
constexpr int most_cells = 2000;

/// Middles between points of two things: 400 pairs, drawn evenly.
std::vector<Vec3> middles_between(const std::vector<Vec3>& a, const std::vector<Vec3>& b) {
  constexpr int pairs = 400;
  std::vector<Vec3> middles;
  middles.reserve(pairs);
  for (int k = 0; k < pairs; ++k) {
    // Two additive sequences of the plastic number fill the square of pairs evenly (Roberts 2018).
    const double s = std::fmod(0.5 + k * 0.7548776662466927, 1),
                 t = std::fmod(0.5 + k * 0.5698402909980532, 1);
    middles.emplace_back((a[static_cast<std::size_t>(s * static_cast<double>(a.size()))] +
                          b[static_cast<std::size_t>(t * static_cast<double>(b.size()))]) /
                         2);
  }
  return middles;
}
}  // namespace

Sight::Sight(const std::vector<Vec3>& points) {
  Vec3 mean = Vec3::Zero();
  for (const Vec3& p : points) mean += p.normalized();
  frame_ = geometry::frame_from_z(mean.normalized());
  double high[2] = {-1e9, -1e9};
  low_[0] = low_[1] = 1e9;
  for (const Vec3& p : points) {
    const Vec3 q = frame_.transpose() * p;
    for (int axis = 0; axis < 2 && q.z() > 0; ++axis) {
      low_[axis] = std::min(low_[axis], q[axis] / q.z());
      high[axis] = std::max(high[axis], q[axis] / q.z());
    }
  }
  for (int axis = 0; axis < 2; ++axis)
    cells_[axis] = std::clamp(static_cast<int>((high[axis] - low_[axis]) / cell_rad) + 1, 1, most_cells);
  nearest_m_.assign(static_cast<std::size_t>(cells_[0]) * static_cast<std::size_t>(cells_[1]), 0);
  for (const Vec3& p : points) {
    const Vec3 q = frame_.transpose() * p;
    if (!(q.z() > 0)) continue;
    const int x = column(q.x() / q.z(), 0), y = column(q.y() / q.z(), 1);
    if (x < 0 || y < 0) continue;
    float& nearest = nearest_m_[static_cast<std::size_t>(y) * static_cast<std::size_t>(cells_[0]) +
                                static_cast<std::size_t>(x)];
    const auto depth = static_cast<float>(p.norm());
    if (nearest == 0 || depth < nearest) nearest = depth;
  }
}

int Sight::column(double tangent, int axis) const {
  const double at = (tangent - low_[axis]) / cell_rad;
  return at >= 0 && at < cells_[axis] ? static_cast<int>(at) : -1;
}

std::array<int, 2> Sight::cell_of(const Vec3& p) const {
  const Vec3 q = frame_.transpose() * p;
  if (!(q.z() > 0)) return {-1, -1};
  return {column(q.x() / q.z(), 0), column(q.y() / q.z(), 1)};
}

Sight::Front Sight::front_of(const std::vector<Vec3>& points) const {
  constexpr int beside = 2;
  int low[2] = {most_cells, most_cells}, high[2] = {-1, -1};
  std::vector<std::array<int, 2>> cells;
  cells.reserve(points.size());
  for (const Vec3& p : points) {
    cells.push_back(cell_of(p));
    for (int axis = 0; axis < 2 && cells.back()[0] >= 0 && cells.back()[1] >= 0; ++axis) {
      low[axis] = std::min(low[axis], cells.back()[axis]);
      high[axis] = std::max(high[axis], cells.back()[axis]);
    }
  }
  if (high[0] < 0) return {};
  Front front{low[0] - beside,
              low[1] - beside,
              high[0] - low[0] + 1 + 2 * beside,
              high[1] - low[1] + 1 + 2 * beside,
              {}};
  front.nearest_m.assign(static_cast<std::size_t>(front.wide) * static_cast<std::size_t>(front.high), 0);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto [x, y] = cells[i];
    if (x < 0 || y < 0) continue;
    const auto depth = static_cast<float>(points[i].norm());
    for (int v = y - beside; v <= y + beside; ++v)
      for (int u = x - beside; u <= x + beside; ++u) {
        float& nearest =
            front.nearest_m[static_cast<std::size_t>(v - front.y) * static_cast<std::size_t>(front.wide) +
                            static_cast<std::size_t>(u - front.x)];
        if (nearest == 0 || depth < nearest) nearest = depth;
      }
  }
  return front;
}

int Sight::hidden_behind(const std::vector<Vec3>& things, const Front& front, double step_m) const {
  int count = 0;
  for (const Vec3& p : things) {
    const auto [x, y] = cell_of(p);
    const int u = x - front.x, v = y - front.y;
    if (x < 0 || y < 0 || u < 0 || v < 0 || u >= front.wide || v >= front.high) continue;
    const float nearest = front.nearest_m[static_cast<std::size_t>(v) * static_cast<std::size_t>(front.wide) +
                                          static_cast<std::size_t>(u)];
    count += nearest > 0 && nearest < p.norm() - step_m;
  }
  return count;
}

bool Sight::empty(const Vec3& p, double behind_m) const {
  const Vec3 q = frame_.transpose() * p;
  if (!(q.z() > 0)) return false;
  const int x = column(q.x() / q.z(), 0), y = column(q.y() / q.z(), 1);
  if (x < 0 || y < 0) return false;
  const double least_m = p.norm() + behind_m;
  bool seen = false;
  for (int v = std::max(0, y - 1); v <= std::min(cells_[1] - 1, y + 1); ++v)
    for (int u = std::max(0, x - 1); u <= std::min(cells_[0] - 1, x + 1); ++u) {
      const float nearest = nearest_m_[static_cast<std::size_t>(v) * static_cast<std::size_t>(cells_[0]) +
                                       static_cast<std::size_t>(u)];
      if (nearest == 0) continue;
      seen = true;
      if (nearest < least_m) return false;
    }
  return seen;
}

double Sight::emptiness_between(const std::vector<Vec3>& a, const std::vector<Vec3>& b,
                                double behind_m) const {
  const auto middles = middles_between(a, b);
  const auto count =
      std::count_if(middles.begin(), middles.end(), [&](const Vec3& p) { return empty(p, behind_m); });
  return static_cast<double>(count) / static_cast<double>(middles.size());
}

double Sight::hidden_between(const std::vector<Vec3>& a, const std::vector<Vec3>& b, const Front& front_a,
                             const Front& front_b, double behind_m) const {
  const auto middles = middles_between(a, b);
  const auto count = std::count_if(middles.begin(), middles.end(), [&](const Vec3& p) {
    const auto [x, y] = cell_of(p);
    if (x < 0 || y < 0) return false;
    const float nearest = nearest_m_[static_cast<std::size_t>(y) * static_cast<std::size_t>(cells_[0]) +
                                     static_cast<std::size_t>(x)];
    return nearest > 0 && nearest < p.norm() - behind_m && hidden_behind({p}, front_a, behind_m) == 0 &&
           hidden_behind({p}, front_b, behind_m) == 0;
  });
  return static_cast<double>(count) / static_cast<double>(middles.size());
}

Sight sight_of(const geometry::PointCloud& cloud) {
  std::vector<Vec3> points;
  points.reserve(cloud.size());
  for (const Vec3& p : cloud.points) points.push_back(p - cloud.sensor_origins.front());
  return Sight(points);
}

}  // namespace geocage::stages
