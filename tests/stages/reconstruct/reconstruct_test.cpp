#include "stages/reconstruct/reconstruct.h"

#include <cmath>
#include <future>
#include <random>

#include <gtest/gtest.h>

#include "datasets/shapes.h"
#include "stages/reconstruct/surfaces.h"

namespace geocage::stages {
namespace {

using geometry::PointCloud;
using geometry::Vec3;

/// The vertices of a mesh with its normals, moved along them by noise.
PointCloud cloud_of(const geometry::TriangleMesh& mesh, double sigma_m) {
  std::mt19937_64 random(1);
  std::normal_distribution<> noise(0, sigma_m);
  PointCloud cloud;
  cloud.normals = vertex_normals(mesh);
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i)
    cloud.points.push_back(mesh.vertices[i] + (sigma_m > 0 ? noise(random) : 0) * cloud.normals[i]);
  return cloud;
}

// Poisson's cells are 1.1 x 0.1 m / 2^7 = 0.9 mm; it averages noise over a cell's points, and extraction is
// linear in it.
TEST(Reconstruct, BallIsClosedAndWhereItShouldBe) {
  for (double sigma : {0.0, 0.0005}) {
    pipeline::Run run;
    const auto mesh = reconstruct({}, run, cloud_of(datasets::icosphere(0.05, 5), sigma));
    const auto report = check_mesh(mesh);
    EXPECT_TRUE(report.closed_manifold()) << flaw(report);
    EXPECT_EQ(report.euler, 2);
    EXPECT_EQ(report.components, 1);
    EXPECT_GT(report.volume_m3, 0);
    for (const Vec3& p : mesh.vertices) EXPECT_NEAR(p.norm(), 0.05, 0.0009 + 3 * sigma);
    EXPECT_GT(run.metrics().at("observed_share"), 0.99);
  }
}

TEST(Reconstruct, TorusKeepsItsHole) {
  pipeline::Run run;
  const auto mesh = reconstruct({}, run, cloud_of(datasets::torus(0.04, 0.012, 120, 40), 0.0003));
  EXPECT_EQ(check_mesh(mesh).euler, 0);
  for (const Vec3& p : mesh.vertices)
    EXPECT_NEAR(std::hypot(std::hypot(p.x(), p.y()) - 0.04, p.z()), 0.012, 0.002);
}

/// What a sensor at 45 degrees sees of a ball of 40 mm that stands on a table.
PointCloud half_seen_ball() {
  const auto all = cloud_of(datasets::icosphere(0.04, 5), 0);
  PointCloud seen;
  seen.sensor_origins = {{0.6, 0, 0.6}};
  seen.support = geometry::Plane{Vec3::UnitZ(), -0.04};
  for (std::size_t i = 0; i < all.size(); ++i)
    if (all.normals[i].dot(seen.sensor_origins[0] - all.points[i]) > 0) {
      seen.points.push_back(all.points[i]);
      seen.normals.push_back(all.normals[i]);
      seen.view.push_back(0);
    }
  return seen;
}

TEST(Reconstruct, WhatOneViewCannotSeeIsClosedAtTheTableAndBehind) {
  pipeline::Run run;
  const auto cloud = half_seen_ball();
  const auto mesh = reconstruct({}, run, cloud);
  const auto report = check_mesh(mesh);
  EXPECT_TRUE(report.closed_manifold());
  EXPECT_EQ(report.euler, 2);
  EXPECT_EQ(run.metrics().at("answered_by"), 0);
  for (const Vec3& p : mesh.vertices)
    EXPECT_GT(p.z(), -0.04 - 0.004);  // not below the table, to one cell of added points
  // Solid down to the farthest seen depth, which is the ball's silhouette: half of it, and what its foot
  // shades.
  const double ball = 4.0 / 3 * M_PI * std::pow(0.04, 3);
  EXPECT_GT(report.volume_m3, 0.45 * ball);
  EXPECT_LT(report.volume_m3, 0.75 * ball);
  EXPECT_LT(run.metrics().at("observed_share"), 0.9);
}

TEST(Reconstruct, SameBytesAgain) {
  pipeline::Run run;
  const auto cloud = half_seen_ball();
  const auto a = reconstruct({}, run, cloud), b = reconstruct({}, run, cloud);
  EXPECT_EQ(a.vertices, b.vertices);
  EXPECT_EQ(a.triangles, b.triangles);
}

TEST(Reconstruct, RefusedPoissonFallsBackToAWrap) {
  pipeline::Run run;
  const auto mesh =
      reconstruct({.close_unseen = false, .most_hole_edges = 0, .most_growth = 1}, run, half_seen_ball());
  EXPECT_EQ(run.metrics().at("answered_by"), 1);
  EXPECT_TRUE(check_mesh(mesh).closed_manifold());
}

// PCL's Poisson has global state: each runs in a process of its own.
TEST(Reconstruct, TwoAtOnceAnswerAsOne) {
  const auto cloud = cloud_of(datasets::icosphere(0.05, 5), 0.0003);
  const auto make = [&] {
    pipeline::Run run;
    return reconstruct({}, run, cloud).vertices;
  };
  const auto expected = make();
  auto a = std::async(std::launch::async, make), b = std::async(std::launch::async, make);
  EXPECT_EQ(a.get(), expected);
  EXPECT_EQ(b.get(), expected);
}

TEST(FillHoles, ClosesWhatIsSmallEnough) {
  auto mesh = datasets::icosphere(0.05, 3);
  mesh.triangles.erase(mesh.triangles.begin() + 10);
  auto left = mesh;
  EXPECT_EQ(fill_holes(left, 2), 0);
  EXPECT_EQ(fill_holes(mesh, 3), 1);
  EXPECT_TRUE(check_mesh(mesh).closed_manifold());
}

}  // namespace
}  // namespace geocage::stages
