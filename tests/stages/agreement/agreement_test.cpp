#include "stages/agreement/agreement.h"

#include <gtest/gtest.h>

#include "datasets/shapes.h"
#include "geometry/noise.h"

namespace geocage::stages {
namespace {

topology::Scores scores_of(const geometry::TriangleMesh& mesh) {
  return {{}, mesh, topology::ball_fields(mesh, {0.03}, topology::Metric::hop).radii.front()};
}

TEST(Agreement, TellsMetersAndRadii) {
  const auto torus = datasets::torus(0.04, 0.012, 48, 16);
  const auto clean = scores_of(torus);
  pipeline::Run run;
  agreement({}, run, clean,
            scores_of(geometry::with_vertex_noise(torus, 0.001, geometry::NoiseDirection::normal, 1)));
  const auto& m = run.metrics();
  EXPECT_EQ(m.at("same_vertices"), 1);
  EXPECT_DOUBLE_EQ(m.at("curvature_drift_radii"), m.at("curvature_drift_m") / 0.03);
  EXPECT_GT(m.at("gap_m"), 0.001);
  EXPECT_LT(m.at("curvature_rank_correlation"), 1);
}

// sigma -> 0: the clean result (a metamorphic test).
TEST(Agreement, GoesToOneWithTheNoise) {
  const auto torus = datasets::torus(0.04, 0.012, 48, 16);
  const auto clean = scores_of(torus);
  double before = -1;
  for (double sigma_m : {1e-3, 1e-4, 1e-9}) {
    pipeline::Run run;
    agreement({}, run, clean,
              scores_of(geometry::with_vertex_noise(torus, sigma_m, geometry::NoiseDirection::normal, 1)));
    const double rank = run.metrics().at("curvature_rank_correlation");
    EXPECT_GT(rank, before);
    before = rank;
  }
}

}  // namespace
}  // namespace geocage::stages
