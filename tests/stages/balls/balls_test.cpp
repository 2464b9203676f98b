#include "stages/balls/balls.h"

#include <gtest/gtest.h>

#include "datasets/shapes.h"
#include "pipeline/error.h"

namespace geocage::stages {
namespace {

TEST(BallsStage, TellsTheMedianShareOfEachRadius) {
  pipeline::Run run;
  const double r = 0.05;
  const auto sphere = datasets::icosphere(r, 4);
  const auto set = balls({.radii_m = {M_PI * r, 0.02}, .metric = "dijkstra"}, run, sphere);
  ASSERT_EQ(set.radii.size(), 2u);
  EXPECT_EQ(set.radii[1].radius_m, 0.02);
  // Edge paths are longer than arcs by 1.24 at most, where edges meet at 72 degrees: between the cap of angle
  // pi / 1.24, (1 - cos) / 2 = 91 % of the sphere, and all of it.
  EXPECT_GT(run.metrics().at("median_share_0"), 0.91);
  EXPECT_LE(run.metrics().at("median_share_0"), 1 + 1e-12);
  // The cap of angle 0.4 is (1 - cos 0.4) / 2 = 0.039 of it; that of 0.4 / 1.24, less one row of triangles of
  // angle 0.06 that are not whole, is 0.017.
  EXPECT_LT(run.metrics().at("median_share_1"), 0.039);
  EXPECT_GT(run.metrics().at("median_share_1"), 0.017);
}

TEST(BallsStage, MetricAndGuardReachTheBalls) {
  pipeline::Run run;
  const auto mesh = datasets::torus(0.05, 0.012, 48, 24);
  const auto hop = balls({.radii_m = {0.02}}, run, mesh);
  const auto dijkstra = balls({.radii_m = {0.02}, .metric = "dijkstra"}, run, mesh);
  const auto strict = balls({.radii_m = {0.02}, .eigenvalue_ratio = 100}, run, mesh);
  EXPECT_NE(hop.radii[0].ball_vertices, dijkstra.radii[0].ball_vertices);
  EXPECT_FALSE(std::isnan(hop.radii[0].winding_angle_rad[0]));
  EXPECT_TRUE(std::isnan(strict.radii[0].winding_angle_rad[0]));
}

void expect_refused(const BallsParams& params, const geometry::TriangleMesh& mesh, pipeline::Fault fault) {
  pipeline::Run run;
  try {
    balls(params, run, mesh);
    FAIL();
  } catch (const pipeline::UserError& error) {
    EXPECT_EQ(error.fault(), fault);
  }
}

TEST(BallsStage, OpenMeshesAndNoRadiiAreRefused) {
  expect_refused({.radii_m = {0.02}}, datasets::open_tube(0.03, 0.1, 24, 8), pipeline::Fault::geometry);
  expect_refused({}, datasets::icosphere(0.05, 2), pipeline::Fault::configuration);
}

}  // namespace
}  // namespace geocage::stages
