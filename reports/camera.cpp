#include "reports/camera.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace geocage::reports {

namespace {

constexpr double half_height = 0.23;  // tan of half the opening angle: 26 degrees from top to bottom
constexpr double border = 1.06;

/// Nearest eye position along one image axis for points (across, towards the eye): both side planes just
/// touch.
struct Fit {
  double low = std::numeric_limits<double>::infinity(), high = -std::numeric_limits<double>::infinity();
  double slope;
  explicit Fit(double s) : slope(s) {}
  void add(double across, double towards) {
    low = std::min(low, across - slope * towards);
    high = std::max(high, across + slope * towards);
  }
  double distance() const { return (high - low) / (2 * slope); }
  double middle() const { return (high + low) / 2; }
};

}  // namespace

Camera::Camera(const View& view, double aspect, const std::vector<Part>& parts)
    : from_(view.from.normalized()),
      right_(view.up.cross(from_).normalized()),
      up_(from_.cross(right_)),
      half_width_(half_height * aspect),
      half_height_(half_height) {
  Fit across(half_width_ / border), along(half_height_ / border);
  for (const Part& part : parts)
    for (const Vec3& p : part.mesh.vertices) {
      across.add(p.dot(right_), p.dot(from_));
      along.add(p.dot(up_), p.dot(from_));
    }
  const double distance = std::max(across.distance(), along.distance());
  eye_ = across.middle() * right_ + along.middle() * up_ + distance * from_;
}

Ray Camera::ray(double x, double y) const {
  const Vec3 direction = (2 * x - 1) * half_width_ * right_ + (1 - 2 * y) * half_height_ * up_ - from_;
  return {eye_, direction.normalized()};
}

}  // namespace geocage::reports
