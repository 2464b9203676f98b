#include "topology/score_agreement.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

#include "datasets/shapes.h"
#include "tests/pipeline/scratch_folder.h"

namespace geocage::topology {
namespace {

/// A sphere whose fields are its heights and minus its heights.
Scores heights(const geometry::TriangleMesh& mesh, double radius_m = 0.03) {
  Scores scores;
  scores.mesh = mesh;
  scores.ball.radius_m = radius_m;
  for (const Vec3& p : mesh.vertices) {
    scores.ball.winding_angle_rad.push_back(p.z());
    scores.ball.curvature_sum_rad.push_back(-p.z());
  }
  return scores;
}

TEST(ScoreAgreement, OfItselfIsWhole) {
  const auto scores = heights(datasets::icosphere(0.05, 3));
  const auto found = agreement_of(scores, scores, 0.1);
  EXPECT_TRUE(found.same_vertices);
  EXPECT_EQ(found.gap_m, 0);
  ASSERT_EQ(found.fields.size(), 2u);
  for (const auto& field : found.fields) {
    EXPECT_NEAR(field.rank_correlation, 1, 1e-12);
    EXPECT_EQ(field.top_overlap, 1);
    EXPECT_EQ(field.drift_m, 0);
  }
}

// The field upside down: ranks reversed, no place in common, and the best has gone to the other pole. Ways
// along edges are at least pi r, and on a mesh of triangles at most 2 / sqrt(3) of it (zigzag), plus what the
// poles miss.
TEST(ScoreAgreement, TurnedRoundIsTheOpposite) {
  const auto mesh = datasets::icosphere(0.05, 4);
  const auto clean = heights(mesh);
  auto noisy = clean;
  std::swap(noisy.ball.winding_angle_rad, noisy.ball.curvature_sum_rad);
  const auto found = agreement_of(clean, noisy, 0.1).fields[0];
  EXPECT_NEAR(found.rank_correlation, -1, 1e-12);
  EXPECT_EQ(found.top_overlap, 0);
  EXPECT_GT(found.drift_m, std::numbers::pi * 0.05 * 0.97);
  EXPECT_LT(found.drift_m, std::numbers::pi * 0.05 * 2 / std::sqrt(3.0) + 0.005);
}

// Two meshes of one sphere: the same field read at nearest vertices. Vertices are at most one edge (0.0035 m
// of a radius of 0.05 m) apart, so ranks move little.
TEST(ScoreAgreement, OtherMeshesAreComparedByNearestVertices) {
  const auto fine = heights(datasets::icosphere(0.05, 4)), coarse = heights(datasets::icosphere(0.05, 3));
  const auto found = agreement_of(fine, coarse, 0.1);
  EXPECT_FALSE(found.same_vertices);
  EXPECT_GT(found.gap_m, 0);
  EXPECT_LT(found.gap_m, 0.008);  // an edge of the coarser one
  for (const auto& field : found.fields) {
    EXPECT_GT(field.rank_correlation, 0.995);
    EXPECT_GT(field.top_overlap, 0.8);
    EXPECT_LT(field.drift_m, 0.008);
  }
}

TEST(ScoreAgreement, WithoutValuesThereIsNoAgreement) {
  const auto clean = heights(datasets::icosphere(0.05, 2));
  auto noisy = clean;
  std::ranges::fill(noisy.ball.winding_angle_rad, std::nan(""));
  const auto found = agreement_of(clean, noisy, 0.1);
  EXPECT_TRUE(std::isnan(found.fields[0].rank_correlation));
  EXPECT_TRUE(std::isnan(found.fields[0].drift_m));
  EXPECT_EQ(found.fields[1].drift_m, 0);
  const tests::ScratchFolder folder;
  save_artefact(found, folder.path());
  ScoreAgreement read;
  load_artefact(read, folder.path());
  EXPECT_TRUE(std::isnan(read.fields[0].top_overlap));
  EXPECT_EQ(read.fields[1].rank_correlation, found.fields[1].rank_correlation);
  EXPECT_EQ(read.radius_m, 0.03);
}

TEST(NearestPoints, AreThoseOfTheFullSearch) {
  std::mt19937 random(7);
  std::uniform_int_distribution<int> cell(0, 12);  // a lattice: many equal distances
  std::vector<Vec3> points(300), others(200);
  for (auto* set : {&points, &others})
    for (Vec3& p : *set) p = Vec3(cell(random), cell(random), cell(random));
  const auto nearest = nearest_points(points, others);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto by_distance = [&](const Vec3& a, const Vec3& b) {
      return (a - points[i]).squaredNorm() < (b - points[i]).squaredNorm();
    };
    EXPECT_EQ(nearest[i], std::ranges::min_element(others, by_distance) - others.begin());
  }
  EXPECT_EQ(nearest_points(points, {}).front(), -1);
}

}  // namespace
}  // namespace geocage::topology
