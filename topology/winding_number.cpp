#include "topology/winding_number.h"

#include <algorithm>
#include <cmath>

namespace geocage::topology {

namespace {

Vec3 in_plane(const Vec3& arrow, const Vec3& normal) {
  return arrow - normal.dot(arrow) * normal;
}

double step_rad(const Vec3& from, const Vec3& to, const Vec3& normal) {
  return std::atan2(normal.dot(from.cross(to)), from.dot(to));
}

/// Derivative of the angle of `arrow` by its tip: (n x arrow) / |arrow|^2, no longer than `most`.
Vec3 angle_gradient(const Vec3& arrow, const Vec3& normal, double most) {
  const double length = arrow.norm();
  if (length == 0) return Vec3::Zero();
  return std::min(1 / length, most) / length * normal.cross(arrow);
}

}  // namespace

double winding_number(const Polyline& curve, const Vec3& center, const Vec3& normal, Turning turning) {
  double angle = 0;
  for (std::size_t i = 0; i + 1 < curve.size(); ++i) {
    const double step =
        step_rad(in_plane(curve[i] - center, normal), in_plane(curve[i + 1] - center, normal), normal);
    angle += turning == Turning::is_signed ? step : std::abs(step);
  }
  return angle / (2 * M_PI);
}

double winding_number(const Polyline& curve, const Vec3& center, const Vec3& normal, Turning turning,
                      std::vector<Vec3>& gradient, double most_gradient_1pm) {
  gradient.assign(curve.size(), Vec3::Zero());
  const double most = 2 * M_PI * most_gradient_1pm;  // of an angle, not of turns
  double angle = 0;
  for (std::size_t i = 0; i + 1 < curve.size(); ++i) {
    const Vec3 from = in_plane(curve[i] - center, normal), to = in_plane(curve[i + 1] - center, normal);
    const double step = step_rad(from, to, normal);
    const double sign = turning == Turning::is_signed ? 1 : step > 0 ? 1 : step < 0 ? -1 : 0;
    angle += sign * step;
    gradient[i] -= sign / (2 * M_PI) * angle_gradient(from, normal, most);
    gradient[i + 1] += sign / (2 * M_PI) * angle_gradient(to, normal, most);
  }
  return angle / (2 * M_PI);
}

}  // namespace geocage::topology
