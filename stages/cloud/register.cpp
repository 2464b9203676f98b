#include "stages/cloud/register.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>
#include <pcl/features/normal_3d.h>
#include <pcl/kdtree/kdtree_flann.h>

#include "geometry/pcl_points.h"

namespace geocage::stages {

using geometry::Pose;
using geometry::Vec3;

namespace {

struct View {
  std::vector<Vec3> points, normals;  ///< normals towards the sensor
  Pose moved = Pose::Identity();
};

void fit_normals(View& view, const Vec3& sensor) {
  pcl::NormalEstimation<pcl::PointXYZ, pcl::Normal> estimation;
  estimation.setInputCloud(geometry::pcl_points(view.points));
  estimation.setKSearch(24);
  pcl::PointCloud<pcl::Normal> normals;
  estimation.compute(normals);
  for (std::size_t i = 0; i < view.points.size(); ++i) {
    const Vec3 n = normals[i].getNormalVector3fMap().cast<double>();
    view.normals.push_back(n.dot(sensor - view.points[i]) < 0 ? Vec3(-n) : n);
  }
}

/// A point of view `of` and the plane of view `on` that it should lie on.
struct Pair {
  std::size_t of, on;
  Vec3 point, normal;
  double distance_m;  ///< signed
};

void add_pairs(const std::vector<View>& views, std::size_t of, double reach_m, std::vector<Pair>& pairs) {
  std::vector<Vec3> points, normals;
  std::vector<std::size_t> owner;
  for (std::size_t v = 0; v < views.size(); ++v)
    for (std::size_t i = 0; v != of && i < views[v].points.size(); ++i) {
      points.push_back(views[v].moved * views[v].points[i]);
      normals.push_back(views[v].moved.linear() * views[v].normals[i]);
      owner.push_back(v);
    }
  if (points.empty()) return;
  pcl::KdTreeFLANN<pcl::PointXYZ> tree;
  tree.setInputCloud(geometry::pcl_points(points));
  const View& view = views[of];
  const std::size_t stride = std::max<std::size_t>(1, view.points.size() / 4000);
  std::vector<int> near(1);
  std::vector<float> squares(1);
  for (std::size_t i = 0; i < view.points.size(); i += stride) {
    const Vec3 p = view.moved * view.points[i];
    const Eigen::Vector3f query = p.cast<float>();
    if (tree.nearestKSearch({query.x(), query.y(), query.z()}, 1, near, squares) == 0) continue;
    const Vec3& n = normals[near[0]];
    const bool alike = n.dot(view.moved.linear() * view.normals[i]) > M_SQRT1_2;  // not where one is NaN
    if (squares[0] < reach_m * reach_m && alike)
      pairs.push_back({of, owner[near[0]], p, n, n.dot(p - points[near[0]])});
  }
}

std::vector<Pair> pairs_of(const std::vector<View>& views, double reach_m) {
  std::vector<Pair> pairs;
  for (std::size_t v = 0; v < views.size(); ++v) add_pairs(views, v, reach_m, pairs);
  return pairs;
}

double rms(const std::vector<Pair>& pairs) {
  double sum = 0;
  for (const Pair& pair : pairs) sum += pair.distance_m * pair.distance_m;
  return std::sqrt(sum / static_cast<double>(std::max<std::size_t>(1, pairs.size())));
}

/// One Gauss-Newton step of all views but the first at once; what the pairs leave free does not move.
void step_together(std::vector<View>& views, const std::vector<Pair>& pairs, double reach_m) {
  const auto size = static_cast<Eigen::Index>(6 * views.size());
  Vec3 middle = Vec3::Zero();
  for (const Pair& pair : pairs) middle += pair.point / static_cast<double>(pairs.size());
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(size, size);
  Eigen::VectorXd pull = Eigen::VectorXd::Zero(size);
  for (const Pair& pair : pairs) {
    const double ratio = pair.distance_m / reach_m, weight = std::pow(std::max(0.0, 1 - ratio * ratio), 2);
    Eigen::Matrix<double, 6, 1> row;
    row << (pair.point - middle).cross(pair.normal), pair.normal;
    const auto of = static_cast<Eigen::Index>(6 * pair.of), on = static_cast<Eigen::Index>(6 * pair.on);
    const Eigen::Matrix<double, 6, 6> block = weight * row * row.transpose();
    information.block<6, 6>(of, of) += block;
    information.block<6, 6>(on, on) += block;
    information.block<6, 6>(of, on) -= block;
    information.block<6, 6>(on, of) -= block;
    pull.segment<6>(of) -= weight * pair.distance_m * row;
    pull.segment<6>(on) += weight * pair.distance_m * row;
  }
  const Eigen::Index free = size - 6;
  Eigen::MatrixXd reduced = information.bottomRightCorner(free, free);
  reduced.diagonal().array() += 1e-8 * reduced.trace() + 1e-12;
  const Eigen::VectorXd moves = reduced.ldlt().solve(pull.tail(free));
  for (std::size_t v = 1; v < views.size(); ++v) {
    const Vec3 turn = moves.segment<3>(static_cast<Eigen::Index>(6 * v - 6)),
               shift = moves.segment<3>(static_cast<Eigen::Index>(6 * v - 3));
    Pose step = Pose::Identity();
    step.translate(middle + shift);
    if (turn.norm() > 0) step.rotate(Eigen::AngleAxisd(turn.norm(), turn.normalized()));
    step.translate(-middle);
    views[v].moved = step * views[v].moved;
  }
}

}  // namespace

Registered register_views(geometry::PointCloud& cloud, double reach_m, int rounds) {
  std::vector<View> views(cloud.sensor_origins.size());
  for (std::size_t i = 0; i < cloud.size(); ++i) views[cloud.view[i]].points.push_back(cloud.points[i]);
  for (std::size_t v = 0; v < views.size(); ++v) fit_normals(views[v], cloud.sensor_origins[v]);
  Registered done;
  done.rms_before_m = rms(pairs_of(views, reach_m));
  for (int round = 0; round < rounds; ++round) {
    const double reach = reach_m * std::pow(0.25, round / std::max(1.0, rounds - 1.0));
    const auto pairs = pairs_of(views, reach);
    if (views.size() > 1 && !pairs.empty()) step_together(views, pairs, reach);
  }
  done.rms_after_m = rms(pairs_of(views, reach_m));
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
