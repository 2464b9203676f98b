#include "stages/score/score.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "datasets/shapes.h"
#include "pipeline/error.h"

namespace geocage::stages {
namespace {

using geometry::TriangleMesh;
using geometry::Vec3;
using topology::Candidate;
using topology::Metric;
using topology::Scores;

/// Shapes here have their centre of mass at the origin.
double offset(const Candidate& c) {
  return c.p_O.cross(c.n_O).norm();
}

/// A pear: two ends of different curvature, no mirror plane but those through x.
TriangleMesh pear() {
  auto mesh = datasets::icosphere(0.04, 4);
  for (Vec3& p : mesh.vertices) p.tail<2>() *= 1 - 6 * p.x();
  return mesh;
}

/// A rod along z, 3 cm thick.
TriangleMesh rod() {
  return datasets::capped_cylinder(0.015, 0.3, 24);
}

Scores scores_of(const TriangleMesh& mesh, const std::vector<double>& radii_m, const ScoreParams& params,
                 pipeline::Run&& run = {}) {
  return score(params, run, mesh, topology::ball_fields(mesh, radii_m, Metric::dijkstra));
}

TEST(ScoreStage, CurvatureFindsTheStrongestVertexFirst) {
  const auto mesh = pear();
  const auto scores = scores_of(mesh, {0.02}, {.heuristics = {"curvature"}, .com_offset_m = 10});
  const auto& s2 = scores.ball.curvature_sum_rad;
  const double low = *std::min_element(s2.begin(), s2.end()), high = *std::max_element(s2.begin(), s2.end());
  ASSERT_EQ(scores.candidates.size(), 12u);
  EXPECT_EQ(scores.candidates[0].curvature_sum_rad, high);
  EXPECT_GT(scores.candidates[0].p_O.x(), 0.035);  // the thin end
  for (std::size_t i = 0; i < scores.candidates.size(); ++i) {
    const Candidate& c = scores.candidates[i];
    EXPECT_NEAR(c.score, (s2[c.vertex] - low) / (high - low), 1e-15);
    EXPECT_EQ(c.p_O, mesh.vertices[c.vertex]);
    EXPECT_EQ(c.center_O, scores.ball.center[c.vertex]);
    EXPECT_LE(c.score, scores.candidates[i == 0 ? 0 : i - 1].score);
  }
}

// Edges meet at 72 degrees at most: paths along them are longer than arcs by 1 / cos(36 degrees) = 1.24 at
// most.
TEST(ScoreStage, CandidatesAreSpreadAndLeaveNoGap) {
  const double r = 0.05, spacing = 0.02;
  const auto sphere = datasets::icosphere(r, 4);
  const auto scores =
      scores_of(sphere, {0.02}, {.heuristics = {"random"}, .max_candidates = 10000, .spacing_m = spacing});
  const auto arc = [&](const Vec3& p, const Vec3& q) {
    return 2 * r * std::asin(std::min(1.0, (p - q).norm() / (2 * r)));
  };
  for (const Candidate& a : scores.candidates)
    for (const Candidate& b : scores.candidates)
      EXPECT_TRUE(a.vertex == b.vertex || arc(a.p_O, b.p_O) > spacing / 1.24);
  for (const Vec3& p : sphere.vertices)
    EXPECT_TRUE(std::any_of(scores.candidates.begin(), scores.candidates.end(),
                            [&](const Candidate& c) { return arc(p, c.p_O) <= spacing; }));
}

TEST(ScoreStage, TheCentreOfMassMustLieNearTheLine) {
  pipeline::Run run;
  const auto mesh = rod();
  const auto balls = topology::ball_fields(mesh, {0.03}, Metric::dijkstra);
  const auto near = score({.com_offset_m = 0.02}, run, mesh, balls);
  ASSERT_GT(near.candidates.size(), 6u);
  for (const Candidate& c : near.candidates) EXPECT_LE(offset(c), 0.02);
  EXPECT_EQ(run.metrics().at("winding_far_candidates"), 0);
  const auto free = score({.com_offset_m = 10}, run, mesh, balls);
  EXPECT_TRUE(std::any_of(free.candidates.begin(), free.candidates.end(),
                          [](const Candidate& c) { return offset(c) > 0.05; }));
}

TEST(ScoreStage, WhereNoLinePassesTheSmallestOffsetsFillUp) {
  pipeline::Run run;
  auto mesh = pear();
  const auto balls = topology::ball_fields(mesh, {0.02}, Metric::dijkstra);
  const auto scores = score({.heuristics = {"curvature"}, .com_offset_m = 1e-12}, run, mesh, balls);
  EXPECT_EQ(run.metrics().at("curvature_eligible") + run.metrics().at("curvature_far_candidates"), 3);
  ASSERT_EQ(scores.candidates.size(), 3u);
  const Vec3 center = geometry::mass_properties(mesh).center;
  const auto normals = geometry::vertex_normals(mesh);
  const auto line_offset = [&](int v) { return (center - mesh.vertices[v]).cross(normals[v]).norm(); };
  double least = 1;
  for (int v = 0; v < static_cast<int>(normals.size()); ++v) least = std::min(least, line_offset(v));
  EXPECT_EQ(line_offset(scores.candidates[0].vertex), least);
  EXPECT_LE(line_offset(scores.candidates[1].vertex), line_offset(scores.candidates[2].vertex));
  score({.heuristics = {"curvature"}, .min_candidates = 0, .com_offset_m = 1e-12}, run, mesh, balls);
  EXPECT_EQ(run.metrics().at("curvature_far_candidates"), 0);
}

// Every ball is a ring of winding angle 2 pi: which comes first is not for the index to say.
TEST(ScoreStage, RingsAreRankedByOffset) {
  const auto scores = scores_of(datasets::torus(0.05, 0.008, 80, 16), {0.035},
                                {.heuristics = {"winding"}, .com_offset_m = 1});
  ASSERT_EQ(scores.candidates.size(), 12u);
  EXPECT_NEAR(offset(scores.candidates[0]), 0, 1e-9);  // an equator's normal meets the axis
  for (std::size_t i = 1; i < scores.candidates.size(); ++i) {
    EXPECT_EQ(scores.candidates[i].winding_angle_rad, 2 * M_PI);
    EXPECT_GE(offset(scores.candidates[i]), offset(scores.candidates[i - 1]) - 1e-15);  // of rounding
  }
}

TEST(ScoreStage, VerticesWithoutAnAxisAreNoWindingCandidates) {
  const auto scores = scores_of(datasets::icosphere(0.05, 4), {0.02}, {.heuristics = {"winding"}});
  const auto& s1 = scores.ball.winding_angle_rad;
  EXPECT_TRUE(std::any_of(s1.begin(), s1.end(), [](double w) { return std::isnan(w); }));
  ASSERT_FALSE(scores.candidates.empty());  // where the icosphere's five-fold vertices stretch the ball
  for (const Candidate& c : scores.candidates) EXPECT_NEAR(c.axis_O.norm(), 1, 1e-14);
}

TEST(ScoreStage, SaturatedRadiusIsReportedAndTheNextSmallerRanked) {
  pipeline::Run run;
  const auto mesh = pear();
  const auto balls = topology::ball_fields(mesh, {0.2, 0.01, 0.02, 0.15}, Metric::dijkstra);
  const auto scores = score({}, run, mesh, balls);
  EXPECT_EQ(run.metrics().at("asked_radius_m"), 0.2);
  EXPECT_NEAR(run.metrics().at("asked_median_share"), 1, 1e-12);
  EXPECT_EQ(run.metrics().at("ranked_radius_m"), 0.02);
  EXPECT_LT(run.metrics().at("ranked_median_share"), 0.5);
  EXPECT_EQ(scores.ball.radius_m, 0.02);
  for (const Candidate& c : scores.candidates) EXPECT_EQ(c.radius_m, 0.02);
}

TEST(ScoreStage, WhereAllRadiiAreSaturatedOnlyRandomCandidatesAreLeft) {
  const auto scores =
      scores_of(pear(), {0.2}, {.heuristics = {"winding", "curvature", "random"}, .com_offset_m = 10});
  ASSERT_FALSE(scores.candidates.empty());
  for (const Candidate& c : scores.candidates) EXPECT_EQ(c.heuristic, "random");
}

TEST(ScoreStage, RandomCandidatesFollowTheSeed) {
  const auto vertices = [](std::uint64_t seed) {
    std::vector<int> all;
    for (const Candidate& c : scores_of(pear(), {0.02}, {.heuristics = {"random"}, .seed = seed}).candidates)
      all.push_back(c.vertex);
    return all;
  };
  EXPECT_EQ(vertices(1), vertices(1));
  EXPECT_NE(vertices(1), vertices(2));
}

TEST(ScoreStage, WindowKeepsWindingAnglesInside) {
  const auto mesh = rod();
  const auto all = scores_of(mesh, {0.02}, {.heuristics = {"winding"}, .com_offset_m = 10});
  ASSERT_FALSE(all.candidates.empty());
  const double best = all.candidates[0].winding_angle_rad, low = best - 0.3, high = best - 0.01;
  const auto some = scores_of(
      mesh, {0.02},
      {.heuristics = {"winding"}, .com_offset_m = 10, .winding_min_rad = low, .winding_max_rad = high});
  ASSERT_FALSE(some.candidates.empty());
  for (const Candidate& c : some.candidates) {
    EXPECT_GE(c.winding_angle_rad, low);
    EXPECT_LE(c.winding_angle_rad, high);
  }
}

TEST(ScoreStage, CombinedIsTheMeanOfBoth) {
  const auto scores = scores_of(pear(), {0.02}, {.heuristics = {"combined"}, .com_offset_m = 10});
  const auto& s1 = scores.ball.winding_angle_rad;
  const auto& s2 = scores.ball.curvature_sum_rad;
  double low = 7, high = 0;
  for (double w : s1)
    if (std::isfinite(w)) {
      low = std::min(low, w);
      high = std::max(high, w);
    }
  const auto [least, most] = std::minmax_element(s2.begin(), s2.end());
  ASSERT_FALSE(scores.candidates.empty());
  for (const Candidate& c : scores.candidates) {
    const double ring = std::isfinite(s1[c.vertex]) ? (s1[c.vertex] - low) / (high - low) : 0;
    EXPECT_NEAR(c.score, (ring + (s2[c.vertex] - *least) / (*most - *least)) / 2, 1e-14);
  }
}

TEST(ScoreStage, TheOtherMetricIsReportedBeside) {
  pipeline::Run run;
  const auto mesh = pear();
  const auto hop = topology::ball_fields(mesh, {0.02}, Metric::hop).radii.front();
  const auto scores =
      score({.beside = "hop"}, run, mesh, topology::ball_fields(mesh, {0.02}, Metric::dijkstra));
  ASSERT_FALSE(scores.candidates.empty());
  for (const Candidate& c : scores.candidates)
    EXPECT_EQ(c.beside_curvature_sum_rad, hop.curvature_sum_rad[c.vertex]);
  EXPECT_GT(run.metrics().at("beside_curvature_rank_correlation"), 0.5);
  for (const Candidate& c : scores_of(mesh, {0.02}, {}).candidates)
    EXPECT_TRUE(std::isnan(c.beside_curvature_sum_rad));
}

// A ring round a torus's tube of radius r: length 2 pi r, its middle on the circle of radius R, its axis
// along that circle. Loops on a mesh of 20 sides are shorter by (pi / 20)^2 / 6, and by as much again where
// sides of the 60 columns come nearer to the core.
TEST(ScoreStage, LoopsAreWhereAHandleCanBeHeld) {
  const double R = 0.05, r = 0.015;
  pipeline::Run run;
  const auto mesh = datasets::torus(R, r, 60, 20);
  const auto scores =
      score({.heuristics = {"loops"}}, run, mesh, topology::ball_fields(mesh, {0.02}, Metric::hop));
  EXPECT_EQ(run.metrics().at("loops_around"), 1);
  ASSERT_GT(scores.candidates.size(), 1u);
  for (const Candidate& c : scores.candidates) {
    EXPECT_EQ(c.score, 1);
    EXPECT_NEAR(c.ring_length_m, 2 * M_PI * r, 0.015 * 2 * M_PI * r);
    EXPECT_NEAR(c.center_O.norm(), R, 0.1 * r);
    EXPECT_NEAR(std::abs(c.axis_O.dot(Vec3::UnitZ().cross(c.center_O).normalized())), 1, 0.01);
    EXPECT_NEAR((c.p_O - c.center_O).norm(), r, 0.35 * r);  // the vertex nearest to the loop
  }
  EXPECT_TRUE(scores_of(pear(), {0.02}, {.heuristics = {"loops"}}).candidates.empty());
}

TEST(ScoreStage, ClosedRingsTellTheirGirth) {
  const auto scores = scores_of(rod(), {0.05}, {.heuristics = {"winding"}, .most_share = 1});
  int rings = 0;
  for (const Candidate& c : scores.candidates) {
    EXPECT_EQ(std::isnan(c.ring_length_m), c.winding_angle_rad < 2 * M_PI);
    if (c.winding_angle_rad < 2 * M_PI || c.axis_O.z() * c.axis_O.z() < 0.999) continue;
    EXPECT_NEAR(c.ring_length_m, 2 * M_PI * 0.015, 0.005 * 2 * M_PI * 0.015);  // 24 sides: (pi / 24)^2 / 6
    ++rings;
  }
  EXPECT_GT(rings, 0);
}

// A waisted rod: rings round it tighten to its waist, 2 pi r of 48 sides there, and none is shorter.
TEST(ScoreStage, RingsPulledTightTellTheNeck) {
  auto mesh = datasets::capped_cylinder(0.015, 0.1, 48);
  const double waist = 0.01;
  for (Vec3& p : mesh.vertices) {
    const double share = 1 - (1 - waist / 0.015) * std::exp(-p.z() * p.z() / (2 * 0.015 * 0.015));
    p.x() *= share;
    p.y() *= share;
  }
  const auto scores = scores_of(
      mesh, {0.04}, {.heuristics = {"winding"}, .com_offset_m = 10, .most_share = 1, .necks = true});
  int necks = 0;
  for (const Candidate& c : scores.candidates) {
    if (std::isnan(c.neck_length_m)) continue;
    EXPECT_LE(c.neck_length_m, c.ring_length_m * (1 + 1e-9));
    EXPECT_NEAR(c.neck_length_m, 2 * M_PI * waist, 0.01 * 2 * M_PI * waist);
    ++necks;
  }
  EXPECT_GT(necks, 0);
}

TEST(ScoreStage, AskedRadiusMustBeThere) {
  EXPECT_EQ(scores_of(pear(), {0.01, 0.02}, {.radius_m = 0.02}).ball.radius_m, 0.02);
  EXPECT_EQ(scores_of(pear(), {0.01, 0.02}, {}).ball.radius_m, 0.01);
  EXPECT_THROW(scores_of(pear(), {0.01, 0.02}, {.radius_m = 0.03}), pipeline::UserError);
}

}  // namespace
}  // namespace geocage::stages
