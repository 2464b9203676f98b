#include "geometry/nearest_of_eight.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <span>

#include <Eigen/Eigenvalues>

namespace geocage::geometry {

namespace {

constexpr int leaf = 4;  // triangles
constexpr double infinity = std::numeric_limits<double>::infinity();

/// Rows: the axes along which the corners spread, least first.
Eigen::Matrix3d axes_of(const std::vector<std::array<Vec3, 3>>& triangles, std::span<const int> some) {
  Vec3 middle = Vec3::Zero();
  for (const int t : some)
    for (const Vec3& p : triangles[t]) middle += p;
  middle /= 3.0 * static_cast<double>(some.size());
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const int t : some)
    for (const Vec3& p : triangles[t]) spread += (p - middle) * (p - middle).transpose();
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(spread).eigenvectors().transpose();
}

/// Direction and length of a side in the triangle's plane.
void put_side(double u, double v, double* into) {
  into[2] = std::hypot(u, v);
  into[0] = into[2] > 0 ? u / into[2] : 1;
  into[1] = into[2] > 0 ? v / into[2] : 0;
}

FlatTriangle flat(const std::array<Vec3, 3>& corners) {
  int from = 0;  // of the longest side
  const auto side = [&](int i) -> Vec3 { return corners[(i + 1) % 3] - corners[i]; };
  for (int i = 1; i < 3; ++i)
    if (side(i).norm() > side(from).norm()) from = i;
  const Vec3 &a = corners[from], ab = side(from), ac = corners[(from + 2) % 3] - a;
  const Vec3 x = ab.norm() > 0 ? Vec3(ab.normalized()) : Vec3::UnitX();
  const Vec3 up = ac - ac.dot(x) * x;
  const Vec3 y =
      up.norm() > 1e-9 * ab.norm() ? Vec3((up - up.dot(x) * x).normalized()) : Vec3(x.unitOrthogonal());
  const Vec3 z = x.cross(y);
  FlatTriangle t{};
  for (int i = 0; i < 3; ++i) {
    t.origin[i] = a[i];
    t.axes[i] = x[i], t.axes[3 + i] = y[i], t.axes[6 + i] = z[i];
  }
  t.length = ab.norm();
  const double u = ac.dot(x), v = std::max(ac.dot(y), 0.0);
  put_side(u, v, t.second);
  put_side(u - t.length, v, t.third);
  return t;
}

}  // namespace

NearestOfEight::NearestOfEight(const TriangleMesh& mesh) : order_(mesh.triangles.size()) {
  Eigen::AlignedBox3d whole;
  for (const auto& t : mesh.triangles)
    for (const int v : t) whole.extend(mesh.vertices[v]);
  center_ = whole.center();
  std::vector<Corners> triangles;
  for (const auto& [a, b, c] : mesh.triangles)
    triangles.push_back({mesh.vertices[a] - center_, mesh.vertices[b] - center_, mesh.vertices[c] - center_});
  std::iota(order_.begin(), order_.end(), 0);
  boxes_.reserve(triangles.size());
  build(triangles, 0, static_cast<int>(triangles.size()), 1e-9 * whole.diagonal().norm());
  place_.resize(triangles.size());
  for (const int t : order_) {
    place_[t] = static_cast<int>(triangles_.size());
    triangles_.push_back(flat(triangles[t]));
  }
}

void NearestOfEight::build(const std::vector<Corners>& triangles, int begin, int end, double slack_m) {
  const std::span<int> some(order_.data() + begin, static_cast<std::size_t>(end - begin));
  const Eigen::Matrix3d axes = axes_of(triangles, some);
  Vec3 low = Vec3::Constant(infinity), high = -low;
  for (const int t : some)
    for (const Vec3& p : triangles[t]) {
      const Vec3 turned = axes * p;
      low = low.cwiseMin(turned);
      high = high.cwiseMax(turned);
    }
  const auto at = boxes_.size();
  TurnedBox box{};
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k) box.axes[3 * i + k] = axes(i, k);
    box.middle[i] = (low[i] + high[i]) / 2;
    box.half[i] = (high[i] - low[i]) / 2 + slack_m;
  }
  boxes_.push_back(box);
  if (end - begin <= leaf) {
    boxes_[at].next = begin;
    boxes_[at].count = end - begin;
    return;
  }
  int longest;
  (high - low).maxCoeff(&longest);
  const auto place = [&, along = Vec3(axes.row(longest))](int t) {
    const auto& corners = triangles[t];
    return along.dot(corners[0] + corners[1] + corners[2]);
  };
  const int half = (end - begin) / 2;
  std::nth_element(some.begin(), some.begin() + half, some.end(), [&](int s, int t) {
    const double at_s = place(s), at_t = place(t);
    return at_s != at_t ? at_s < at_t : s < t;
  });
  build(triangles, begin, begin + half, slack_m);
  boxes_[at].next = static_cast<int>(boxes_.size());
  build(triangles, begin + half, end, slack_m);
}

void NearestOfEight::measure(Points& points) const {
  Packet packet;
  for (int k = 0; k < Packet::size; ++k) {
    const Vec3 p = points.points_O[k] - center_;
    packet.x[k] = p.x(), packet.y[k] = p.y(), packet.z[k] = p.z();
    packet.least2[k] = infinity;
  }
  const auto& guesses = points.nearest;
  for (auto guess = guesses.begin(); guess != guesses.end(); ++guess)
    if (std::find(guesses.begin(), guess, *guess) == guess)
      measure_place(triangles_.data(), place_[*guess], packet);
  measure_nearest(boxes_.data(), triangles_.data(), packet);
  for (int k = 0; k < Packet::size; ++k) {
    points.distance_m[k] = std::sqrt(packet.least2[k]);
    points.nearest[k] = order_[packet.nearest[k]];
  }
}

}  // namespace geocage::geometry
