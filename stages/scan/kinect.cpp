#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <optional>

#include "stages/scan/noise_models.h"

namespace geocage::stages {

using geometry::DepthCamera;
using geometry::RandomStream;
using geometry::Vec3;

namespace {

/// A smooth random field over the image, of mean square 1: five waves with wavelengths of a third of the
/// image's width up to all of it. It is the sensor's, so all its views share it.
class SmoothField {
 public:
  SmoothField(RandomStream random, double width_px) {
    for (std::size_t k = 0; k < waves_.size(); ++k) {
      const double turn = 2 * M_PI * random.uniform();
      const double k_1px = 2 * M_PI * (1 + 0.5 * static_cast<double>(k)) / width_px;
      waves_[k] = {k_1px * std::cos(turn), k_1px * std::sin(turn), 2 * M_PI * random.uniform()};
    }
  }
  double at(double u, double v) const {
    double sum = 0;
    for (const Vec3& w : waves_) sum += std::cos(w.x() * u + w.y() * v + w.z());
    return sum * std::sqrt(2.0 / static_cast<double>(waves_.size()));
  }

 private:
  std::array<Vec3, 5> waves_;
};

/// White noise seen through a window of w x h pixels: a number a pixel of deviation 1, in rows; neighbours
/// share most of the window, so that they err alike.
std::vector<double> windowed_noise(RandomStream& random, const DepthCamera& camera, int w, int h) {
  const int columns = camera.width + w - 1, rows = camera.height + h - 1;
  std::vector<double> lines(static_cast<std::size_t>(camera.width) * rows);  // summed along rows
  std::vector<double> row(static_cast<std::size_t>(columns));
  for (int y = 0; y < rows; ++y) {
    for (double& value : row) value = random.normal();
    for (int x = 0; x < camera.width; ++x)
      lines[static_cast<std::size_t>(y) * camera.width + x] =
          std::accumulate(row.begin() + x, row.begin() + x + w, 0.0);
  }
  std::vector<double> noise(static_cast<std::size_t>(camera.width) * camera.height);
  for (int y = 0; y < camera.height; ++y)
    for (int x = 0; x < camera.width; ++x) {
      double sum = 0;
      for (int k = 0; k < h; ++k) sum += lines[static_cast<std::size_t>(y + k) * camera.width + x];
      noise[static_cast<std::size_t>(y) * camera.width + x] = sum / std::sqrt(w * h);
    }
  return noise;
}

int pixels(double size_rad, double focal_px) {
  return std::max(1, static_cast<int>(std::lround(size_rad * focal_px)));
}

class Kinect {
 public:
  explicit Kinect(const Exposure& view)
      : view_(view),
        p_(view.params),
        axial_(noise()),
        jitter_u_(noise()),
        jitter_v_(noise()),
        depth_bias_(RandomStream(p_.seed, 1u << 20), view.camera.width),
        warp_u_(RandomStream(p_.seed, (1u << 20) + 1), view.camera.width),
        warp_v_(RandomStream(p_.seed, (1u << 20) + 2), view.camera.width) {}

  std::vector<SeenPoint> points() {
    const DepthCamera& camera = view_.camera;
    clean_.reserve(static_cast<std::size_t>(camera.width) * camera.height);
    for (int y = 0; y < camera.height; ++y)
      for (int x = 0; x < camera.width; ++x) clean_.push_back(depth(x + 0.5, y + 0.5));
    std::vector<SeenPoint> points;
    for (int y = 0; y < camera.height; ++y)
      for (int x = 0; x < camera.width; ++x)
        if (const auto point = measured(x, y)) points.push_back(*point);
    return points;
  }

 private:
  std::vector<double> noise() const {
    const DepthCamera& camera = view_.camera;
    return windowed_noise(view_.random, camera, pixels(p_.window_width_rad, camera.fx_px),
                          pixels(p_.window_height_rad, camera.fy_px));
  }
  Vec3 along(double u, double v) const {
    return (view_.camera.X_OS.linear() * view_.camera.direction_S(u, v)).normalized();
  }
  double depth_of(double range_m, double u, double v) const {
    return range_m / view_.camera.direction_S(u, v).norm();
  }
  std::optional<double> depth(double u, double v) const {
    const auto hit = view_.scene.first_hit(view_.camera.p_OS(), along(u, v));
    if (!hit) return {};
    return depth_of(hit->range_m, u, v);
  }

  /// A pixel's point as the sensor tells it; nothing where it has none. Always draws the same number of
  /// random numbers, so that one pixel's fate does not change the next one's noise.
  std::optional<SeenPoint> measured(int x, int y) {
    RandomStream& random = view_.random;
    const std::size_t pixel = static_cast<std::size_t>(y) * view_.camera.width + x;
    const double lost = random.uniform(), flies = random.uniform(), how_far = random.uniform();
    const double fx = view_.camera.fx_px, u0 = x + 0.5, v0 = y + 0.5;
    const double u = u0 + fx * (p_.lateral_rad * jitter_u_[pixel] + p_.warp_rad * warp_u_.at(u0, v0));
    const double v = v0 + fx * (p_.lateral_rad * jitter_v_[pixel] + p_.warp_rad * warp_v_.at(u0, v0));
    const Vec3 ray = along(u, v);
    const auto hit = view_.scene.first_hit(view_.camera.p_OS(), ray);
    if (!hit || shadowed(view_.camera.p_OS() + hit->range_m * ray)) return {};
    const double incidence = std::acos(std::min(1.0, std::abs(hit->normal_O.dot(ray))));
    const double grazing = p_.grazing_deg * M_PI / 180;
    const double weak = std::clamp((incidence - grazing) / (M_PI / 2 - grazing), 0.0, 1.0);
    if (lost <= p_.dropout_share + (1 - p_.dropout_share) * weak) return {};

    double z = depth_of(hit->range_m, u, v);
    if (flies <= p_.flying_share) z += how_far * room_behind(x, y, z);
    double inverse = 1 / z + p_.axial_1pm * axial_[pixel] + p_.bias_1pm * depth_bias_.at(u0, v0);
    if (p_.step_1pm > 0) inverse = std::round(inverse / p_.step_1pm) * p_.step_1pm;
    if (inverse <= 0) return {};
    const double range = view_.camera.direction_S(u0, v0).norm() / inverse;
    if (range < p_.range_min_m || range > p_.range_max_m) return {};
    return SeenPoint{view_.camera.X_OS * (view_.camera.direction_S(u0, v0) / inverse), hit->normal_O};
  }

  /// The projector stands beside the camera; what it does not light has no depth.
  bool shadowed(const Vec3& p) const {
    const Vec3 projector = view_.camera.X_OS * Vec3(p_.baseline_m, 0, 0);
    const Vec3 way = p - projector;
    const auto hit = view_.scene.first_hit(projector, way.normalized());
    return hit && hit->range_m < way.norm() - 1e-3;
  }

  /// How far behind z a pixel at a silhouette may slip: to the surface that its neighbour sees, `flying_m` at
  /// most. 0 away from silhouettes.
  double room_behind(int x, int y, double z) const {
    double room = 0;
    for (const auto& [dx, dy] : {std::pair{1, 0}, {-1, 0}, {0, 1}, {0, -1}}) {
      const int i = x + dx, j = y + dy;
      if (i < 0 || j < 0 || i >= view_.camera.width || j >= view_.camera.height) continue;
      const auto& next = clean_[static_cast<std::size_t>(j) * view_.camera.width + i];
      const double step = next ? *next - z : p_.flying_m;
      if (step > p_.flying_m / 2) room = std::max(room, std::min(step, p_.flying_m));
    }
    return room;
  }

  const Exposure& view_;
  const ScanParams& p_;
  const std::vector<double> axial_, jitter_u_, jitter_v_;
  const SmoothField depth_bias_, warp_u_, warp_v_;
  std::vector<std::optional<double>> clean_;
};

}  // namespace

std::vector<SeenPoint> kinect_points(const Exposure& view) {
  return Kinect(view).points();
}

}  // namespace geocage::stages
