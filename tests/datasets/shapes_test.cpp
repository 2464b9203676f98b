#include "datasets/shapes.h"

#include <cmath>
#include <functional>
#include <numbers>

#include <gtest/gtest.h>

namespace geocage::datasets {
namespace {

using std::numbers::pi;

// Sums of some thousand terms of order V: far below 1e-12 of it.
constexpr double rounding = 1e-12;

struct Exact {
  const char* name;
  TriangleMesh mesh;
  double volume_m3, area_m2;
};

TEST(Shapes, PolyhedraHaveTheirClosedForms) {
  const double slice = 30 * std::sin(2 * pi / 60);  // area of a regular 60-gon of circumradius 1
  const double mantle = 2 * 60 * std::sin(pi / 60);
  const std::vector<Exact> solids = {
      {"tetrahedron", tetrahedron(), std::sqrt(2) / 12, std::sqrt(3)},
      {"cube", cube(), 1, 6},
      {"octahedron", octahedron(), std::sqrt(2) / 3, 2 * std::sqrt(3)},
      {"icosahedron", icosahedron(), 5 * (3 + std::sqrt(5)) / 12, 5 * std::sqrt(3)},
      {"box", box({0.1, 0.2, 0.3}, 4), 0.006, 0.22},
      {"cylinder", capped_cylinder(0.03, 0.1, 60), slice * 9e-4 * 0.1,
       2 * slice * 9e-4 + mantle * 0.03 * 0.1},
      {"cup", cup(0.04, 0.1, 0.003, 60), slice * (0.0016 * 0.1 - 0.037 * 0.037 * 0.097),
       slice * 2 * 0.0016 + mantle * (0.04 * 0.1 + 0.037 * 0.097)},
  };
  for (const auto& [name, mesh, volume, area] : solids) {
    const auto report = geometry::check_mesh(mesh);
    EXPECT_EQ(geometry::flaw(report), "") << name;
    EXPECT_EQ(report.euler, 2) << name;
    EXPECT_NEAR(report.volume_m3, volume, rounding * volume) << name;
    EXPECT_NEAR(report.area_m2, area, rounding * area) << name;
  }
}

TEST(Shapes, RegularSolidsHaveUnitEdges) {
  for (const auto& mesh : {tetrahedron(), octahedron(), icosahedron()})
    for (const auto& [a, b, c] : mesh.triangles)
      EXPECT_NEAR((mesh.vertices[a] - mesh.vertices[b]).norm(), 1, rounding);
}

// Inscribed polyhedra miss the smooth shape by c / n^2: twice the points must leave a quarter of the error.
void expect_second_order(const std::function<TriangleMesh(int)>& shape, double volume, double area) {
  const auto coarse = geometry::check_mesh(shape(1)), fine = geometry::check_mesh(shape(2));
  EXPECT_NEAR((volume - coarse.volume_m3) / (volume - fine.volume_m3), 4, 0.05);
  EXPECT_NEAR((area - coarse.area_m2) / (area - fine.area_m2), 4, 0.05);
}

TEST(Shapes, SphereAndTorusConvergeToTheirClosedForms) {
  expect_second_order([](int n) { return icosphere(0.1, n + 2); }, 4.0 / 3 * pi * 1e-3, 4 * pi * 0.01);
  expect_second_order([](int n) { return torus(0.1, 0.03, 48 * n, 24 * n); }, 2 * pi * pi * 0.1 * 9e-4,
                      4 * pi * pi * 0.003);
}

TEST(Shapes, PointsLieOnTheSmoothSurface) {
  for (const Vec3& p : icosphere(0.1, 3).vertices) EXPECT_NEAR(p.norm(), 0.1, 1e-16);
  for (const Vec3& p : torus(0.1, 0.03, 48, 24).vertices)
    EXPECT_NEAR(std::hypot(std::hypot(p.x(), p.y()) - 0.1, p.z()), 0.03, 1e-16);
}

TEST(Shapes, TopologyIsAsTold) {
  const auto ring = geometry::check_mesh(torus(0.1, 0.03, 48, 24));
  EXPECT_TRUE(ring.closed_manifold());
  EXPECT_EQ(ring.euler, 0);
  const auto two = geometry::check_mesh(double_torus(0.1, 0.03, 48, 24));
  EXPECT_TRUE(two.closed_manifold());
  EXPECT_EQ(two.euler, -2);
  EXPECT_EQ(two.components, 1);
  EXPECT_NEAR(two.volume_m3, 2 * geometry::check_mesh(torus(0.1, 0.03, 48, 24)).volume_m3, 1e-7);  // the tube
  const auto tube = geometry::check_mesh(open_tube(0.03, 0.1, 40, 3));
  EXPECT_EQ(tube.euler, 0);
  EXPECT_EQ(tube.boundary_edges, 2 * 40);
  EXPECT_EQ(tube.triangles, 2 * 40 * 3);
  const auto grid = geometry::check_mesh(flat_grid(1, 7));
  EXPECT_EQ(grid.euler, 1);
  EXPECT_EQ(grid.boundary_edges, 4 * 7);
  EXPECT_NEAR(grid.area_m2, 1, rounding);
  EXPECT_EQ(geometry::check_mesh(icosphere(1, 3)).triangles, 20 * 64);
}

}  // namespace
}  // namespace geocage::datasets
