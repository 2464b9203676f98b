#include "stages/score/score.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <queue>
#include <random>

#include <fmt/format.h>

#include "pipeline/error.h"
#include "topology/agreement.h"
#include "topology/loops.h"

namespace geocage::stages {

using geometry::TriangleMesh;
using geometry::Vec3;
using topology::BallFields;
using topology::Candidate;

void ScoreParams::visit(pipeline::Fields& f) {
  f("radius_m", radius_m, {0, 10}, "radius of the balls that are ranked; 0 is the hand's own");
  f("heuristics", heuristics, {"winding", "curvature", "combined", "loops", "random"},
    "what candidates are chosen by");
  f("max_candidates", max_candidates, {1, 10000}, "candidates of each heuristic");
  f("min_candidates", min_candidates, {0, 10000},
    "where the centre of mass leaves fewer, vertices of the smallest offset fill up");
  f("spacing_m", spacing_m, {0, 1},
    "candidates of a heuristic are farther apart than this along the surface");
  f("com_offset_m", com_offset_m, {0, 10},
    "the centre of mass must lie this near to the line through the vertex along its normal");
  f("most_share", most_share, {0, 1},
    "a radius whose median ball holds more of the surface is reported, not ranked");
  f("winding_min_rad", winding_min_rad, {0, 7}, "winding candidates have at least this winding angle");
  f("winding_max_rad", winding_max_rad, {0, 7}, "and at most this one");
  f("beside", beside, {"none", "hop", "dijkstra"}, "metric of a second ball, reported beside the ranked one");
  f("necks", necks, "rings of winding candidates are pulled tight over the surface, too");
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
  scaled.reserve(values.size());
  for (double x : values) scaled.push_back(high > low ? (x - low) / (high - low) : x * 0);
  return scaled;
}

/// Winding angles inside the window; NaN elsewhere.
std::vector<double> windowed(const ScoreParams& params, std::vector<double> angles) {
  for (double& w : angles)
    if (w < params.winding_min_rad || w > params.winding_max_rad) w = std::nan("");
  return angles;
}

/// The mean of both normalised scores: a vertex must be good for a ring and for a shell. Without an axis
/// there is no ring: half of the other.
std::vector<double> combined(const std::vector<double>& winding, const std::vector<double>& curvature) {
  std::vector<double> values;
  for (std::size_t v = 0; v < winding.size(); ++v)
    values.push_back(((std::isfinite(winding[v]) ? winding[v] : 0) + curvature[v]) / 2);
  return values;
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

/// What the candidates of one object have in common.
struct Bodies {
  const TriangleMesh& mesh;
  const BallFields& ball;
  std::vector<Vec3> normals = geometry::vertex_normals(mesh);
  std::vector<double> offsets = line_offsets(mesh, normals);
  geometry::CompressedRows neighbours = geometry::vertex_neighbours(mesh);

  Candidate candidate(int v, const std::string& heuristic, double score) const {
    return {.vertex = v,
            .heuristic = heuristic,
            .score = score,
            .radius_m = ball.radius_m,
            .winding_angle_rad = ball.winding_angle_rad[v],
            .curvature_sum_rad = ball.curvature_sum_rad[v],
            .euler = ball.euler[v],
            .p_O = mesh.vertices[v],
            .n_O = normals[v],
            .center_O = ball.center[v],
            .axis_O = ball.axis[v],
            .com_offset_m = offsets[v]};
  }
};

/// Candidates of a field over the vertices.
void add_by_field(const ScoreParams& params, pipeline::Run& run, const Bodies& body,
                  const std::string& heuristic, const std::vector<double>& values,
                  std::vector<Candidate>& candidates) {
  const auto ranked = ranking(values, body.offsets, params.com_offset_m);
  const auto chosen = choose(params, body.mesh, body.neighbours, ranked);
  std::optional<topology::NumberedEdges> edges;
  for (int v : chosen.vertices) {
    Candidate c = body.candidate(v, heuristic, values[v]);
    if (heuristic == "winding" && c.winding_angle_rad == 2 * M_PI) {
      if (!edges) edges.emplace(body.mesh);
      if (const auto ring = topology::section_loop(body.mesh, *edges, c.p_O, c.center_O, c.axis_O))
        c.ring_length_m = ring->length_m;
      if (params.necks)
        if (const auto neck = topology::neck_loop(body.mesh, *edges, c.p_O, c.center_O, c.axis_O))
          c.neck_length_m = neck->length_m;
    }
    candidates.push_back(std::move(c));
  }
  run.metric(heuristic + "_eligible", static_cast<double>(ranked.near));
  run.metric(heuristic + "_candidates", static_cast<double>(chosen.vertices.size()));
  run.metric(heuristic + "_far_candidates", chosen.far);
}

/// The vertex nearest to p.
int nearest_vertex(const TriangleMesh& mesh, const Vec3& p) {
  int best = 0;
  for (int v = 1; v < static_cast<int>(mesh.vertices.size()); ++v)
    if ((mesh.vertices[v] - p).squaredNorm() < (mesh.vertices[best] - p).squaredNorm()) best = v;
  return best;
}

/// Where a hand could close around a handle: for each loop around one, the loop's point of the smallest
/// offset that is far enough from those taken. Axis: normal of the loop's plane, which is the handle's
/// tangent.
void add_at_loops(const ScoreParams& params, pipeline::Run& run, const Bodies& body,
                  std::vector<Candidate>& candidates) {
  std::vector<topology::SurfaceLoop> loops = topology::handle_loops(body.mesh);
  std::erase_if(loops, [](const auto& loop) { return loop.kind != topology::LoopKind::around; });
  const std::size_t before = candidates.size();
  std::vector<char> covered(body.mesh.vertices.size(), 0);
  bool more = true;
  for (int turn = 0; more && turn < params.max_candidates; ++turn) {  // a point of each loop, and again
    more = false;
    for (const auto& loop : loops) {
      if (static_cast<int>(candidates.size() - before) >= params.max_candidates) break;
      int best = -1;
      Vec3 center = Vec3::Zero(), axis = Vec3::Zero();
      for (std::size_t i = 0; i < loop.path.size(); ++i) {
        const Vec3 &p = loop.path[i], &q = loop.path[(i + 1) % loop.path.size()];
        center += (p + q) / 2 * (q - p).norm() / loop.length_m;
        axis += p.cross(q);  // twice the loop's vector area
        const int v = nearest_vertex(body.mesh, p);
        if (!covered[v] && (best < 0 || body.offsets[v] < body.offsets[best])) best = v;
      }
      if (best < 0) continue;
      more = true;
      mark_around(body.mesh, body.neighbours, best, params.spacing_m, covered);
      Candidate c = body.candidate(best, "loops", loops.front().length_m / loop.length_m);
      c.center_O = center;
      c.axis_O = axis.normalized();
      c.ring_length_m = loop.length_m;
      candidates.push_back(std::move(c));
    }
  }
  std::stable_sort(candidates.begin() + static_cast<std::ptrdiff_t>(before), candidates.end(),
                   [](const Candidate& a, const Candidate& b) { return a.score > b.score; });
  run.metric("loops_around", static_cast<double>(loops.size()));
  run.metric("loops_candidates", static_cast<double>(candidates.size() - before));
}

/// The ball of the other metric for every candidate, and how both rank the vertices.
void report_beside(const ScoreParams& params, pipeline::Run& run, topology::Scores& scores) {
  const auto metric = params.beside == "hop" ? topology::Metric::hop : topology::Metric::dijkstra;
  const auto beside = topology::ball_fields(scores.mesh, {scores.ball.radius_m}, metric).radii.front();
  for (Candidate& c : scores.candidates) {
    c.beside_winding_angle_rad = beside.winding_angle_rad[c.vertex];
    c.beside_curvature_sum_rad = beside.curvature_sum_rad[c.vertex];
  }
  const auto tell = [&](const char* name, const std::vector<double>& a, const std::vector<double>& b) {
    const double agreement = topology::rank_correlation(a, b);
    if (std::isfinite(agreement)) run.metric(name, agreement);
  };
  tell("beside_winding_rank_correlation", scores.ball.winding_angle_rad, beside.winding_angle_rad);
  tell("beside_curvature_rank_correlation", scores.ball.curvature_sum_rad, beside.curvature_sum_rad);
}

}  // namespace

topology::Scores score(const ScoreParams& params, pipeline::Run& run, const TriangleMesh& mesh,
                       const topology::BallSet& balls) {
  const double area = geometry::check_mesh(mesh).area_m2;
  topology::Scores scores{{}, mesh, ranked_ball(params, run, balls, area)};
  const BallFields& ball = scores.ball;
  const Bodies body{mesh, ball};
  const bool rankable = topology::median_share(ball, area) <= params.most_share;
  const auto winding = [&] { return normalised(windowed(params, ball.winding_angle_rad)); };
  const auto curvature = [&] { return normalised(ball.curvature_sum_rad); };
  const auto add = [&](const std::string& heuristic, const std::vector<double>& values) {
    add_by_field(params, run, body, heuristic, values, scores.candidates);
  };

  for (const auto& heuristic : params.heuristics) {
    if (heuristic == "random") add(heuristic, normalised(random_values(mesh.vertices.size(), params.seed)));
    if (heuristic == "loops") add_at_loops(params, run, body, scores.candidates);
    if (!rankable) continue;
    if (heuristic == "winding") add(heuristic, winding());
    if (heuristic == "curvature") add(heuristic, curvature());
    if (heuristic == "combined") add(heuristic, combined(winding(), curvature()));
  }
  if (params.beside != "none") report_beside(params, run, scores);
  return scores;
}

}  // namespace geocage::stages
