#include "tests/bench/placement_centres.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numbers>
#include <numeric>
#include <random>

namespace geocage::bench {

using geometry::Vec3;

namespace {

constexpr double spacing_m = 0.015, com_offset_m = 0.02;

double uniform(std::mt19937_64& random) {
  return static_cast<double>(random() >> 11) * 0x1p-53;
}

/// NaN where the ball has no axis.
double girth_m(const geometry::TriangleMesh& mesh, const topology::BallFields& ball, std::size_t v) {
  const Vec3& axis = ball.axis[v];
  if (axis.norm() < 0.5) return std::nan("");
  return 2 * std::numbers::pi * (mesh.vertices[v] - ball.center[v]).cross(axis).norm();
}

/// The ball whose ring is nearest to the middle of the group's girths; the first one for all other groups.
std::size_t ball_of(const Group& group, const geometry::TriangleMesh& mesh,
                    const std::vector<topology::BallFields>& balls, std::size_t v) {
  std::size_t best = 0;
  if (group.heuristic != "girth") return best;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < balls.size(); ++i) {
    const double off = std::abs(girth_m(mesh, balls[i], v) - (group.low + group.high) / 2);
    if (off < least) least = off, best = i;
  }
  return best;
}

/// Larger is better; NaN is no centre.
double value_of(const Group& group, const geometry::TriangleMesh& mesh, const topology::BallFields& ball,
                std::size_t v, double offset_m, double chance) {
  if (group.heuristic == "girth") {
    const double girth = girth_m(mesh, ball, v);
    return girth >= group.low && girth <= group.high ? -offset_m : std::nan("");
  }
  const double s1 = ball.winding_angle_rad[v];
  if (group.heuristic == "winding") return s1;
  if (group.heuristic == "curvature") return ball.curvature_sum_rad[v];
  if (group.heuristic == "window") return s1 >= group.low && s1 <= group.high ? -offset_m : std::nan("");
  if (group.heuristic == "ties")
    return std::isnan(s1) ? s1 : std::min(s1, 2 * std::numbers::pi - 1e-6) - offset_m;
  return chance;
}

}  // namespace

std::string Group::name() const {
  char range[40] = "";
  if (heuristic == "window") std::snprintf(range, sizeof range, " %.1f-%.1f", low, high);
  if (heuristic == "girth") std::snprintf(range, sizeof range, " %.0f-%.0f mm", 1e3 * low, 1e3 * high);
  return heuristic + range + (com_rule ? "+com" : "");
}

std::vector<topology::Candidate> centres_of(const Group& group, const geometry::TriangleMesh& mesh,
                                            const std::vector<topology::BallFields>& balls, int count,
                                            unsigned seed) {
  std::mt19937_64 random(seed);
  const Vec3 center = geometry::mass_properties(mesh).center;
  const auto normals = geometry::vertex_normals(mesh);
  std::vector<double> values, chances;
  std::vector<int> order;
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    const double offset_m = (center - mesh.vertices[v]).cross(normals[v]).norm();
    chances.push_back(uniform(random));
    values.push_back(
        value_of(group, mesh, balls[ball_of(group, mesh, balls, v)], v, offset_m, chances.back()));
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
    const topology::BallFields& ball = balls[ball_of(group, mesh, balls, static_cast<std::size_t>(v))];
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
