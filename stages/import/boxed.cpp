#include "stages/import/boxed.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace geocage::stages {

using geometry::Vec3;

namespace {

/// Where the face at one end lies: at the far one if `high`.
double face_at(std::vector<double>& along, bool high) {
  const std::size_t few = along.size() / 50, k = high ? along.size() - 1 - few : few;
  std::nth_element(along.begin(), along.begin() + static_cast<std::ptrdiff_t>(k), along.end());
  return along[k];
}

/// Distances from the face; that lies towards the origin, or is the top.
std::vector<double> from_face(std::vector<double> along, bool top) {
  double sum = 0;
  for (double x : along) sum += x;
  auto sorted = along;
  const double at = face_at(sorted, top || sum < 0);
  for (double& x : along) x = std::abs(x - at);
  return along;
}

}  // namespace

double boxed_off_m(const std::vector<Vec3>& seen, const geometry::Plane& table) {
  constexpr std::size_t most = 200;
  constexpr int turns = 30;
  const Eigen::Matrix3d frame = geometry::frame_from_z(table.normal);
  const std::size_t step = (seen.size() + most - 1) / most;
  std::vector<double> x, y, z;
  for (std::size_t i = 0; i < seen.size(); i += step) {
    const Vec3 q = frame.transpose() * seen[i];
    x.push_back(q.x());
    y.push_back(q.y());
    z.push_back(q.z());
  }
  const auto from_top = from_face(z, true);
  const auto along = [&](double turn) {
    std::vector<double> list(x.size());
    for (std::size_t i = 0; i < x.size(); ++i) list[i] = std::cos(turn) * x[i] + std::sin(turn) * y[i];
    return from_face(std::move(list), false);
  };
  double least = std::numeric_limits<double>::infinity();
  for (int k = 0; k < turns; ++k) {
    const double turn = M_PI / 2 * k / turns;
    const auto from_one = along(turn), from_other = along(turn + M_PI / 2);
    double sum = 0;
    for (std::size_t i = 0; i < x.size(); ++i) sum += std::min({from_top[i], from_one[i], from_other[i]});
    least = std::min(least, sum / static_cast<double>(x.size()));
  }
  return least;
}

}  // namespace geocage::stages
