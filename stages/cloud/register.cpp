#include "stages/cloud/register.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>
#include <pcl/features/normal_3d.h>
#include <pcl/kdtree/kdtree_flann.h>

namespace geocage::stages {

using geometry::Pose;
using geometry::Vec3;

namespace {

using Points = pcl::PointCloud<pcl::PointXYZ>;

Points::Ptr to_pcl(const std::vector<Vec3>& points) {
  Points::Ptr out(new Points);
  for (const Vec3& p : points)
    out->emplace_back(static_cast<float>(p.x()), static_cast<float>(p.y()), static_cast<float>(p.z()));
  return out;
}

struct View {
  std::vector<Vec3> points, normals;  ///< normals towards the sensor
  Pose moved = Pose::Identity();
};

void fit_normals(View& view, const Vec3& sensor) {
  pcl::NormalEstimation<pcl::PointXYZ, pcl::Normal> estimation;
  estimation.setInputCloud(to_pcl(view.points));
  estimation.setKSearch(24);
  pcl::PointCloud<pcl::Normal> normals;
  estimation.compute(normals);
  for (std::size_t i = 0; i < view.points.size(); ++i) {
    const Vec3 n = normals[i].getNormalVector3fMap().cast<double>();
    view.normals.push_back(n.dot(sensor - view.points[i]) < 0 ? Vec3(-n) : n);
  }
}

/// Pairs of a point and the plane it should lie on.
struct Pairs {
  std::vector<Vec3> point, normal;
  std::vector<double> distance;  ///< signed
  double rms() const {
    double sum = 0;
    for (double d : distance) sum += d * d;
    return std::sqrt(sum / static_cast<double>(std::max<std::size_t>(1, distance.size())));
  }
};

Pairs pairs_of(const std::vector<View>& views, std::size_t mine, double reach_m) {
  std::vector<Vec3> points, normals;
  for (std::size_t v = 0; v < views.size(); ++v)
    if (v != mine)
      for (std::size_t i = 0; i < views[v].points.size(); ++i) {
        points.push_back(views[v].moved * views[v].points[i]);
        normals.push_back(views[v].moved.linear() * views[v].normals[i]);
      }
  Pairs pairs;
  if (points.empty()) return pairs;
  pcl::KdTreeFLANN<pcl::PointXYZ> tree;
  tree.setInputCloud(to_pcl(points));
  const View& view = views[mine];
  const std::size_t stride = std::max<std::size_t>(1, view.points.size() / 4000);
  std::vector<int> near(1);
  std::vector<float> squares(1);
  for (std::size_t i = 0; i < view.points.size(); i += stride) {
    const Vec3 p = view.moved * view.points[i];
    const pcl::PointXYZ query(static_cast<float>(p.x()), static_cast<float>(p.y()),
                              static_cast<float>(p.z()));
    if (tree.nearestKSearch(query, 1, near, squares) == 0 || squares[0] > reach_m * reach_m) continue;
    const Vec3& n = normals[near[0]];
    if (!n.allFinite() || n.dot(view.moved.linear() * view.normals[i]) < M_SQRT1_2) continue;
    pairs.point.push_back(p);
    pairs.normal.push_back(n);
    pairs.distance.push_back(n.dot(p - points[near[0]]));
  }
  return pairs;
}

/// One Gauss-Newton step; what the pairs leave free does not move.
Pose step_towards(const Pairs& pairs, double reach_m) {
  using Vector6 = Eigen::Matrix<double, 6, 1>;
  Vec3 middle = Vec3::Zero();
  for (const Vec3& p : pairs.point) middle += p;
  middle /= static_cast<double>(std::max<std::size_t>(1, pairs.point.size()));
  Eigen::Matrix<double, 6, 6> information = Eigen::Matrix<double, 6, 6>::Zero();
  Vector6 pull = Vector6::Zero();
  for (std::size_t i = 0; i < pairs.point.size(); ++i) {
    const double ratio = pairs.distance[i] / reach_m, weight = std::pow(std::max(0.0, 1 - ratio * ratio), 2);
    Vector6 row;
    row << (pairs.point[i] - middle).cross(pairs.normal[i]), pairs.normal[i];
    information += weight * row * row.transpose();
    pull -= weight * pairs.distance[i] * row;
  }
  const double damping = 1e-6 * std::max(1e-12, information.trace());
  information.diagonal().array() += damping;
  const Vector6 move = information.ldlt().solve(pull);
  const Vec3 turn = move.head<3>();
  Pose step = Pose::Identity();
  step.translate(middle + move.tail<3>());
  if (turn.norm() > 0) step.rotate(Eigen::AngleAxisd(turn.norm(), turn.normalized()));
  step.translate(-middle);
  return step;
}

double mean_rms(const std::vector<View>& views, double reach_m) {
  double sum = 0;
  for (std::size_t v = 1; v < views.size(); ++v) sum += pairs_of(views, v, reach_m).rms();
  return sum / static_cast<double>(std::max<std::size_t>(1, views.size() - 1));
}

}  // namespace

Registered register_views(geometry::PointCloud& cloud, double reach_m, int rounds) {
  std::vector<View> views(cloud.sensor_origins.size());
  for (std::size_t i = 0; i < cloud.size(); ++i) views[cloud.view[i]].points.push_back(cloud.points[i]);
  for (std::size_t v = 0; v < views.size(); ++v) fit_normals(views[v], cloud.sensor_origins[v]);
  Registered done;
  done.rms_before_m = mean_rms(views, reach_m);
  for (int round = 0; round < rounds; ++round) {
    const double reach = reach_m * std::pow(0.25, round / std::max(1.0, rounds - 1.0));
    for (std::size_t v = 1; v < views.size(); ++v)
      if (const Pairs pairs = pairs_of(views, v, reach); pairs.point.size() >= 50)
        views[v].moved = step_towards(pairs, reach) * views[v].moved;
  }
  done.rms_after_m = mean_rms(views, reach_m);
  for (std::size_t i = 0; i < cloud.size(); ++i)
    cloud.points[i] = views[cloud.view[i]].moved * cloud.points[i];
  for (std::size_t v = 0; v < views.size(); ++v) {
    const Vec3 before = cloud.sensor_origins[v];
    cloud.sensor_origins[v] = views[v].moved * before;
    done.largest_move_m = std::max(done.largest_move_m, (cloud.sensor_origins[v] - before).norm());
  }
  return done;
}

}  // namespace geocage::stages
