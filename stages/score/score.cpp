#include "stages/score/score.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <queue>
#include <random>

#include <fmt/format.h>

#include "pipeline/error.h"

namespace geocage::stages {

using geometry::TriangleMesh;
using geometry::Vec3;
using topology::BallFields;
using topology::Candidate;

void ScoreParams::visit(pipeline::Fields& f) {
  f("radius_m", radius_m, {0, 10}, "radius of the balls that are ranked; 0 is the hand's own");
  f("heuristics", heuristics, {"winding", "curvature", "random"}, "what candidates are chosen by");
  f("max_candidates", max_candidates, {1, 10000}, "candidates of each heuristic");
  f("min_candidates", min_candidates, {0, 10000},
    "where the centre of mass leaves fewer, vertices of the smallest offset fill up");
  f("spacing_m", spacing_m, {0, 1},
    "candidates of a heuristic are farther apart than this along the surface");
  f("com_offset_m", com_offset_m, {0, 10},
    "the centre of mass must lie this near to the line through the vertex along its normal");
  f("most_share", most_share, {0, 1},
    "a radius whose median ball holds more of the surface is reported, not ranked");
  f("seed", seed, "of the random candidates");
}

namespace {

/// The ball of the asked radius, or, where its median ball holds too much of the surface for a ranking, the
/// largest smaller one that does not.
const BallFields& ranked_ball(const ScoreParams& params, pipeline::Run& run, const topology::BallSet& balls,
                              double area) {
  const auto asked = std::find_if(balls.radii.begin(), balls.radii.end(), [&](const BallFields& ball) {
    return params.radius_m == 0 || std::abs(ball.radius_m - params.radius_m) < 1e-9;
  });
  if (asked == balls.radii.end())
    throw pipeline::UserError(pipeline::Fault::configuration, "score.radius_m",
                              fmt::format("no ball has the radius {} m", params.radius_m),
                              "add it to balls.radii_m");
  const BallFields* best = &*asked;
  run.metric("asked_radius_m", best->radius_m);
  run.metric("asked_median_share", topology::median_share(*best, area));
  if (topology::median_share(*best, area) > params.most_share) {
    const BallFields* smaller = nullptr;
    for (const BallFields& ball : balls.radii)
      if (ball.radius_m < asked->radius_m && topology::median_share(ball, area) <= params.most_share &&
          (!smaller || ball.radius_m > smaller->radius_m))
        smaller = &ball;
    if (smaller) best = smaller;
    run.log(fmt::format("the median ball of {} m holds more than {:.0f} % of the surface: {}",
                        asked->radius_m, 100 * params.most_share,
                        smaller ? fmt::format("{} m is ranked", best->radius_m) : "no radius can be ranked"));
  }
  run.metric("ranked_radius_m", best->radius_m);
  run.metric("ranked_median_share", topology::median_share(*best, area));
  return *best;
}

/// Distance of the centre of mass from the line p - t n.
std::vector<double> line_offsets(const TriangleMesh& mesh, const std::vector<Vec3>& normals) {
  const Vec3 center = geometry::mass_properties(mesh).center;
  std::vector<double> offsets;
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
    offsets.push_back((center - mesh.vertices[v]).cross(normals[v]).norm());
  return offsets;
}

/// Scaled to [0, 1] over the mesh; NaN stays.
std::vector<double> normalised(const std::vector<double>& values) {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (double x : values)
    if (std::isfinite(x)) {
      low = std::min(low, x);
      high = std::max(high, x);
    }
  std::vector<double> scaled;
  for (double x : values) scaled.push_back(high > low ? (x - low) / (high - low) : x * 0);
  return scaled;
}

/// Uniform in [0, 1) for each vertex: the control that scores must beat.
std::vector<double> random_values(std::size_t count, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::vector<double> values(count);
  for (double& x : values) x = static_cast<double>(random() >> 11) * 0x1p-53;
  return values;
}

/// Marks every vertex within `radius_m` of `source` along edges.
void mark_around(const TriangleMesh& mesh, const geometry::CompressedRows& neighbours, int source,
                 double radius_m, std::vector<char>& marked) {
  std::priority_queue<std::pair<double, int>, std::vector<std::pair<double, int>>, std::greater<>> queue;
  std::vector<double> best(mesh.vertices.size(), std::numeric_limits<double>::infinity());
  best[source] = 0;
  queue.emplace(0, source);
  while (!queue.empty()) {
    const auto [d, v] = queue.top();
    queue.pop();
    if (d > best[v]) continue;
    marked[v] = 1;
    for (int i = neighbours.start[v]; i < neighbours.start[v + 1]; ++i) {
      const int w = neighbours.items[i];
      const double next = d + (mesh.vertices[v] - mesh.vertices[w]).norm();
      if (next > radius_m || next >= best[w]) continue;
      best[w] = next;
      queue.emplace(next, w);
    }
  }
}

/// Vertices that have a score. First those whose line passes near the centre of mass, best first; equal
/// scores (rings are all 2 pi) by offset. Behind them the others, smallest offset first.
struct Ranking {
  std::vector<int> order;
  std::ptrdiff_t near;  ///< how many of them pass near
};

Ranking ranking(const std::vector<double>& scores, const std::vector<double>& offsets, double most_offset) {
  Ranking all;
  auto& order = all.order;
  for (int v = 0; v < static_cast<int>(scores.size()); ++v)
    if (std::isfinite(scores[v])) order.push_back(v);
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return offsets[a] < offsets[b]; });
  const auto far = std::find_if(order.begin(), order.end(), [&](int v) { return offsets[v] > most_offset; });
  std::stable_sort(order.begin(), far, [&](int a, int b) { return scores[a] > scores[b]; });
  all.near = far - order.begin();
  return all;
}

/// Goes down the ranking and takes what is not within `spacing_m` of what was taken before.
struct Choice {
  std::vector<int> vertices;
  int far = 0;  ///< how many of them are taken in spite of their offset
};

Choice choose(const ScoreParams& params, const TriangleMesh& mesh, const geometry::CompressedRows& neighbours,
              const Ranking& ranked) {
  Choice choice;
  std::vector<char> covered(mesh.vertices.size(), 0);
  for (std::ptrdiff_t i = 0; i < std::ssize(ranked.order); ++i) {
    const bool far = i >= ranked.near;
    const int v = ranked.order[i];
    const int most = far ? std::min(params.min_candidates, params.max_candidates) : params.max_candidates;
    if (std::ssize(choice.vertices) >= most) break;
    if (covered[v]) continue;
    mark_around(mesh, neighbours, v, params.spacing_m, covered);
    choice.vertices.push_back(v);
    choice.far += far;
  }
  return choice;
}

}  // namespace

topology::Scores score(const ScoreParams& params, pipeline::Run& run, const TriangleMesh& mesh,
                       const topology::BallSet& balls) {
  const double area = geometry::check_mesh(mesh).area_m2;
  topology::Scores scores{{}, mesh, ranked_ball(params, run, balls, area)};
  const BallFields& ball = scores.ball;
  const auto normals = geometry::vertex_normals(mesh);
  const auto offsets = line_offsets(mesh, normals);
  const auto neighbours = geometry::vertex_neighbours(mesh);
  const bool rankable = topology::median_share(ball, area) <= params.most_share;

  for (const auto& heuristic : params.heuristics) {
    if (!rankable && heuristic != "random") continue;
    const auto values =
        normalised(heuristic == "winding"     ? ball.winding_angle_rad
                   : heuristic == "curvature" ? ball.curvature_sum_rad
                                              : random_values(mesh.vertices.size(), params.seed));
    const auto ranked = ranking(values, offsets, params.com_offset_m);
    const auto chosen = choose(params, mesh, neighbours, ranked);
    for (int v : chosen.vertices)
      scores.candidates.push_back({.vertex = v,
                                   .heuristic = heuristic,
                                   .score = values[v],
                                   .radius_m = ball.radius_m,
                                   .winding_angle_rad = ball.winding_angle_rad[v],
                                   .curvature_sum_rad = ball.curvature_sum_rad[v],
                                   .euler = ball.euler[v],
                                   .p_O = mesh.vertices[v],
                                   .n_O = normals[v],
                                   .center_O = ball.center[v],
                                   .axis_O = ball.axis[v],
                                   .com_offset_m = offsets[v]});
    run.metric(heuristic + "_eligible", static_cast<double>(ranked.near));
    run.metric(heuristic + "_candidates", static_cast<double>(chosen.vertices.size()));
    run.metric(heuristic + "_far_candidates", chosen.far);
  }
  return scores;
}

}  // namespace geocage::stages
