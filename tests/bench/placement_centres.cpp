#include "tests/bench/placement_centres.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <random>

namespace geocage::bench {

using geometry::Vec3;

namespace {

constexpr double spacing_m = 0.015, com_offset_m = 0.02;
constexpr double window_low_rad = 4.1, window_high_rad = 4.6;

double uniform(std::mt19937_64& random) {
  return static_cast<double>(random() >> 11) * 0x1p-53;
}

/// Larger is better; NaN is no centre.
double value_of(const Group& group, const topology::BallFields& ball, std::size_t v, double offset_m,
                double chance) {
  const double s1 = ball.winding_angle_rad[v];
  if (group.heuristic == "winding") return s1;
  if (group.heuristic == "curvature") return ball.curvature_sum_rad[v];
  if (group.heuristic == "window")
    return s1 >= window_low_rad && s1 <= window_high_rad ? -offset_m : std::nan("");
  if (group.heuristic == "ties")
    return std::isnan(s1) ? s1 : std::min(s1, 2 * std::numbers::pi - 1e-6) - offset_m;
  return chance;
}

}  // namespace

std::vector<topology::Candidate> centres_of(const Group& group, const geometry::TriangleMesh& mesh,
                                            const topology::BallFields& ball, int count, unsigned seed) {
  std::mt19937_64 random(seed);
  const Vec3 center = geometry::mass_properties(mesh).center;
  const auto normals = geometry::vertex_normals(mesh);
  std::vector<double> values, chances;
  std::vector<int> order;
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    const double offset_m = (center - mesh.vertices[v]).cross(normals[v]).norm();
    chances.push_back(uniform(random));
    values.push_back(value_of(group, ball, v, offset_m, chances.back()));
    if (!std::isnan(values.back()) && (!group.com_rule || offset_m <= com_offset_m))
      order.push_back(static_cast<int>(v));
  }
  std::sort(order.begin(), order.end(), [&](int a, int b) {
    return std::pair(values[a], chances[a]) > std::pair(values[b], chances[b]);
  });
  std::vector<topology::Candidate> centres;
  for (int v : order) {
    if (static_cast<int>(centres.size()) == count) break;
    const Vec3& p = mesh.vertices[v];
    if (std::any_of(centres.begin(), centres.end(),
                    [&](const topology::Candidate& c) { return (c.p_O - p).norm() < spacing_m; }))
      continue;
    topology::Candidate candidate;
    candidate.vertex = v;
    candidate.heuristic = group.name();
    candidate.score = values[v];
    candidate.radius_m = ball.radius_m;
    candidate.winding_angle_rad = ball.winding_angle_rad[v];
    candidate.curvature_sum_rad = ball.curvature_sum_rad[v];
    candidate.p_O = p;
    candidate.n_O = normals[v];
    candidate.center_O = ball.center[v];
    candidate.axis_O = ball.axis[v];
    centres.push_back(candidate);
  }
  return centres;
}

double saturated_share(const topology::BallFields& ball) {
  const auto full = [](double s1) { return s1 >= 2 * std::numbers::pi - 1e-9; };
  return static_cast<double>(
             std::count_if(ball.winding_angle_rad.begin(), ball.winding_angle_rad.end(), full)) /
         static_cast<double>(ball.winding_angle_rad.size());
}

}  // namespace geocage::bench
