#include "stages/import/sight.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace geocage::stages {

using geometry::Vec3;

namespace {
constexpr double cell_rad = 0.0025;  // 2 mm at 0.8 m: a pixel and a half of a Kinect
constexpr int most_cells = 2000;
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

int Sight::cell_of(const Vec3& p) const {
  const Vec3 q = frame_.transpose() * p;
  if (!(q.z() > 0)) return -1;
  const int x = column(q.x() / q.z(), 0), y = column(q.y() / q.z(), 1);
  return x < 0 || y < 0 ? -1 : y * cells_[0] + x;
}

int Sight::hidden_behind(const std::vector<Vec3>& things, const std::vector<Vec3>& front,
                         double step_m) const {
  constexpr int reach = 2;
  std::map<int, double> nearest;
  for (const Vec3& p : front)
    if (const int cell = cell_of(p); cell >= 0) {
      const auto known = nearest.emplace(cell, p.norm()).first;
      known->second = std::min(known->second, p.norm());
    }
  int count = 0;
  for (const Vec3& p : things) {
    const int cell = cell_of(p);
    bool hidden = false;
    for (int v = -reach; v <= reach && cell >= 0 && !hidden; ++v)
      for (int u = -reach; u <= reach && !hidden; ++u) {
        const auto known = nearest.find(cell + v * cells_[0] + u);
        hidden = known != nearest.end() && known->second < p.norm() - step_m;
      }
    count += hidden;
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
  constexpr int pairs = 400;
  int empty_ones = 0;
  for (int k = 0; k < pairs; ++k) {
    // Two additive sequences of the plastic number fill the square of pairs evenly (Roberts 2018).
    const double s = std::fmod(0.5 + k * 0.7548776662466927, 1),
                 t = std::fmod(0.5 + k * 0.5698402909980532, 1);
    const Vec3& p = a[static_cast<std::size_t>(s * static_cast<double>(a.size()))];
    const Vec3& q = b[static_cast<std::size_t>(t * static_cast<double>(b.size()))];
    empty_ones += empty((p + q) / 2, behind_m);
  }
  return static_cast<double>(empty_ones) / pairs;
}

Sight sight_of(const geometry::PointCloud& cloud) {
  std::vector<Vec3> points;
  points.reserve(cloud.size());
  for (const Vec3& p : cloud.points) points.push_back(p - cloud.sensor_origins.front());
  return Sight(points);
}

}  // namespace geocage::stages
