#include "stages/scan/noise_models.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace geocage::stages {

using geometry::PointCloud;
using geometry::RandomStream;
using geometry::Vec3;

std::vector<SeenPoint> clean_points(const Exposure& view) {
  const auto& camera = view.camera;
  std::vector<SeenPoint> points;
  for (int y = 0; y < camera.height; ++y)
    for (int x = 0; x < camera.width; ++x) {
      const Vec3 ray = (camera.X_OS.linear() * camera.direction_S(x + 0.5, y + 0.5)).normalized();
      const auto hit = view.scene.first_hit(camera.p_OS(), ray);
      if (!hit || hit->range_m < view.params.range_min_m || hit->range_m > view.params.range_max_m) continue;
      points.push_back({camera.p_OS() + hit->range_m * ray, hit->normal_O});
    }
  return points;
}

std::vector<Vec3> with_gaussian(const std::vector<SeenPoint>& points, const Exposure& view, double sigma_m) {
  std::vector<Vec3> moved;
  for (const auto& [p, normal] : points) {
    if (view.params.along == "ray")
      moved.push_back(p + sigma_m * view.random.normal() * (p - view.camera.p_OS()).normalized());
    else if (view.params.along == "normal")
      moved.push_back(p + sigma_m * view.random.normal() * normal);
    else
      moved.push_back(p + sigma_m * view.random.normal_vector());
  }
  return moved;
}

void add_outliers(std::vector<Vec3>& points, const Vec3& sensor, double share, const Vec3& center,
                  double radius_m, RandomStream& random) {
  for (Vec3& p : points) {
    const double chosen = random.uniform(), where = random.uniform();
    if (chosen > share) continue;
    const Vec3 ray = (p - sensor).normalized();
    const double middle = (center - sensor).dot(ray);
    const double aside = (center - sensor - middle * ray).norm();
    const double half = std::sqrt(std::max(0.0, radius_m * radius_m - aside * aside));
    p = sensor + std::max(0.0, middle + (2 * where - 1) * half) * ray;
  }
}

void lose_parts(PointCloud& cloud, double views_share, double surface_share, RandomStream& random) {
  const auto views = static_cast<int>(cloud.sensor_origins.size());
  std::vector<double> lots;
  for (int v = 0; v < views; ++v) lots.push_back(random.uniform());
  std::vector<int> order(cloud.sensor_origins.size());
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](int a, int b) { return lots[a] < lots[b]; });
  const int lost_views = std::min(views - 1, static_cast<int>(std::lround(views_share * views)));
  std::vector<bool> gone(cloud.sensor_origins.size());
  for (int k = 0; k < lost_views; ++k) gone[order[k]] = true;

  std::vector<int> left;
  for (std::size_t i = 0; i < cloud.size(); ++i)
    if (!gone[cloud.view[i]]) left.push_back(static_cast<int>(i));
  const double chosen = random.uniform();
  if (!left.empty() && surface_share > 0) {
    const auto count = static_cast<double>(left.size());
    const Vec3 hole = cloud.points[left[static_cast<std::size_t>(std::min(count - 1, chosen * count))]];
    std::stable_sort(left.begin(), left.end(), [&](int a, int b) {
      return (cloud.points[a] - hole).squaredNorm() < (cloud.points[b] - hole).squaredNorm();
    });
    left.erase(left.begin(), left.begin() + std::lround(surface_share * count));
    std::sort(left.begin(), left.end());
  }
  cloud = geometry::subset(cloud, left);
}

geometry::Pose pose_error(const Vec3& sensor, double sigma_m, double sigma_rad, RandomStream& random) {
  const Vec3 turn = sigma_rad * random.normal_vector(), shift = sigma_m * random.normal_vector();
  const Eigen::AngleAxisd rotation(turn.norm(), turn.norm() > 0 ? turn.normalized() : Vec3::UnitX());
  geometry::Pose error = geometry::Pose::Identity();
  error.translate(sensor + shift).rotate(rotation).translate(-sensor);
  return error;
}

}  // namespace geocage::stages
