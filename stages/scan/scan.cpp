#include "stages/scan/scan.h"

#include <cmath>
#include <random>

#include "geometry/ray_scene.h"
#include "pipeline/error.h"

namespace geocage::stages {

using geometry::PointCloud;
using geometry::TriangleMesh;
using geometry::Vec3;

void ScanParams::visit(pipeline::Fields& f) {
  f("views", views, {1, 1000}, "views, spread evenly over a sphere around the object");
  f("width", width, {8, 4096}, "pixels of a row");
  f("height", height, {8, 4096}, "pixels of a column");
  f("distance_diagonals", distance_diagonals, {0.6, 100},
    "distance of the sensor from the centre, in diagonals of the object's box");
  f("sigma_m", sigma_m, {0, 0.1}, "standard deviation of the Gaussian noise");
  f("noise", noise, {"ray", "isotropic"}, "noise along the ray, or in all three directions");
  f("seed", seed, "of the noise");
}

namespace {

/// Normal numbers by Box and Muller: std::normal_distribution differs between libraries.
class Gauss {
 public:
  Gauss(std::uint64_t seed, std::uint64_t stream) : random_(seed * 0x9e3779b97f4a7c15u + stream) {}
  double operator()() {
    const double radius = std::sqrt(-2 * std::log(unit())), angle = 2 * M_PI * unit();
    return radius * std::cos(angle);
  }

 private:
  /// Uniform in (0, 1].
  double unit() { return static_cast<double>((random_() >> 11) + 1) * 0x1p-53; }
  std::mt19937_64 random_;
};

/// The k-th of n directions spread evenly over the sphere (Fibonacci lattice).
Vec3 direction(int k, int n) {
  const double z = 1 - (2 * k + 1.0) / n, angle = k * M_PI * (3 - std::sqrt(5.0)), r = std::sqrt(1 - z * z);
  return {r * std::cos(angle), r * std::sin(angle), z};
}

/// A pinhole camera whose frame the object's bounding ball just fills.
struct Camera {
  Vec3 p_OS;
  Eigen::Matrix3d R_OS;  ///< x right, y down, z along the view
  double half_tan;

  Vec3 ray(int x, int y, int width, int height) const {
    const double pixel = 2 * half_tan / std::min(width, height);
    const Vec3 d((x + 0.5 - width / 2.0) * pixel, (y + 0.5 - height / 2.0) * pixel, 1);
    return (R_OS * d).normalized();
  }
};

std::vector<Vec3> see(const ScanParams& params, const geometry::RayScene& scene, const Camera& camera,
                      int view) {
  Gauss gauss(params.seed, static_cast<std::uint64_t>(view));
  std::vector<Vec3> points;
  for (int y = 0; y < params.height; ++y)
    for (int x = 0; x < params.width; ++x) {
      const Vec3 along = camera.ray(x, y, params.width, params.height);
      const auto hit = scene.first_hit(camera.p_OS, along);
      if (!hit) continue;
      const Vec3 p = camera.p_OS + hit->range_m * along;
      if (params.noise == "ray") {
        points.push_back(p + params.sigma_m * gauss() * along);
      } else {
        const double dx = gauss(), dy = gauss(), dz = gauss();
        points.push_back(p + params.sigma_m * Vec3(dx, dy, dz));
      }
    }
  return points;
}

}  // namespace

PointCloud scan(const ScanParams& params, pipeline::Run& run, const TriangleMesh& mesh) {
  const auto report = geometry::check_mesh(mesh);
  const Vec3 center = (report.box_min + report.box_max) / 2;
  const double distance = params.distance_diagonals * report.diagonal_m();
  const geometry::RayScene scene(mesh, center);
  std::vector<Camera> cameras;
  for (int k = 0; k < params.views; ++k) {
    const Vec3 d = direction(k, params.views);
    // The ball of half a diagonal at this distance: sin = 1 / (2 distance_diagonals).
    cameras.push_back({center + distance * d, geometry::frame_from_z(-d),
                       std::tan(std::asin(0.5 / params.distance_diagonals))});
  }
  std::vector<std::vector<Vec3>> seen(cameras.size());
#pragma omp parallel for schedule(dynamic, 1)
  for (std::size_t k = 0; k < cameras.size(); ++k)
    seen[k] = see(params, scene, cameras[k], static_cast<int>(k));

  PointCloud cloud;
  for (std::size_t k = 0; k < cameras.size(); ++k) {
    cloud.sensor_origins.push_back(cameras[k].p_OS);
    cloud.points.insert(cloud.points.end(), seen[k].begin(), seen[k].end());
    cloud.view.insert(cloud.view.end(), seen[k].size(), static_cast<int>(k));
  }
  if (cloud.points.empty())
    throw pipeline::UserError(pipeline::Fault::geometry, "scan", "no ray meets the surface",
                              "is the mesh empty or far too thin?");
  run.metric("points", static_cast<double>(cloud.size()));
  run.metric("sensor_distance_m", distance);
  return cloud;
}

}  // namespace geocage::stages
