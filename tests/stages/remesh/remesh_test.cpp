#include "stages/remesh/remesh.h"

#include <cmath>

#include <gtest/gtest.h>

#include "datasets/shapes.h"
#include "pipeline/error.h"

namespace geocage::stages {
namespace {

using geometry::Vec3;

TEST(Remesh, BallHasOneEdgeLength) {
  pipeline::Run run;
  const double r = 0.05, h = 0.004;
  const auto mesh = remesh({.edge_length_m = h}, run, datasets::icosphere(r, 5));
  const auto report = check_mesh(mesh);
  EXPECT_TRUE(report.closed_manifold());
  EXPECT_EQ(report.euler, 2);
  EXPECT_NEAR(report.mean_edge_m, h, 0.15 * h);  // the loop keeps edges between 4/5 and 4/3 of h
  EXPECT_LT(report.edge_cv, 0.2);
  EXPECT_GT(report.min_angle_rad, 25 * M_PI / 180);
  // Vertices are projected onto facets, which lie inside the ball by edge^2 / (6 r) at most.
  for (const Vec3& p : mesh.vertices) {
    EXPECT_LE(p.norm(), r + 1e-9);
    EXPECT_GE(p.norm(), r - std::pow(0.0035, 2) / (6 * r));
  }
}

TEST(Remesh, GenusIsKept) {
  for (const auto& shape : {datasets::torus(0.04, 0.012, 80, 30), datasets::cup(0.04, 0.1, 0.004, 80)}) {
    pipeline::Run run;
    EXPECT_EQ(check_mesh(remesh({}, run, shape)).euler, check_mesh(shape).euler);
  }
}

TEST(Remesh, SameBytesAgain) {
  pipeline::Run run;
  const auto shape = datasets::torus(0.04, 0.012, 80, 30);
  const auto a = remesh({}, run, shape), b = remesh({}, run, shape);
  EXPECT_EQ(a.vertices, b.vertices);
  EXPECT_EQ(a.triangles, b.triangles);
}

TEST(Remesh, OddWishesAndOpenMeshesAreRefused) {
  pipeline::Run run;
  EXPECT_THROW(remesh({.edge_length_m = 0.05}, run, datasets::icosphere(0.05, 3)), pipeline::UserError);
  EXPECT_THROW(remesh({.edge_length_m = 0.0002}, run, datasets::icosphere(1.0, 3)), pipeline::UserError);
  EXPECT_THROW(remesh({}, run, datasets::flat_grid(0.1, 10)), pipeline::UserError);
}

}  // namespace
}  // namespace geocage::stages
