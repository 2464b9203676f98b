#include "datasets/shapes.h"

#include <cmath>
#include <functional>
#include <numbers>

#include <gtest/gtest.h>

#include "pipeline/error.h"

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
  // The joint adds half a cell of 17 x 8 mm times its length of some 9 mm: 6e-7.
  EXPECT_NEAR(two.volume_m3, 2 * geometry::check_mesh(torus(0.1, 0.03, 48, 24)).volume_m3, 1e-6);
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

/// Volume of the cap that a ball of radius R loses beyond the circle of radius r.
double cap_m3(double R, double r) {
  const double d = std::sqrt(R * R - r * r);
  return pi * (R - d) * (R - d) * (2 * R + d) / 3;
}

// Circles of 64 points and arcs of equal chords lie inside the smooth surface: a regular 64-gon lacks
// (2 pi / 64)^2 / 6 = 0.16 % of its area, an arc as much of its height, so each part lacks less than 0.5 %; a
// bowl's hollow is smaller too.
TEST(Shapes, OfTheCatalogueHaveTheirVolumes) {
  struct Known {
    const char* name;
    std::vector<double> size_m;
    double volume_m3, tolerance_m3;
    int euler;
  };
  const double ball = 4.0 / 3 * pi;
  const double R = 0.03, r = 0.012, apart = 0.1, k = 0.018, n = 0.008;
  const double dumbbell_m3 =
      2 * (ball * R * R * R - cap_m3(R, r)) + pi * r * r * (apart - 2 * std::sqrt(R * R - r * r));
  const double knobbed_m3 = pi * R * R * 0.08 + pi * n * n * 0.02 + ball * k * k * k - cap_m3(k, n);
  const double bowl_m3 = ball / 2 * (std::pow(0.06, 3) - std::pow(0.054, 3));
  for (const Known& known :
       {Known{"sphere", {R}, ball * R * R * R, 0.005 * ball * R * R * R, 2},
        Known{"torus", {0.04, r}, 2 * pi * pi * 0.04 * r * r, 0.01 * 2 * pi * pi * 0.04 * r * r, 0},
        Known{"cylinder", {0.025, 0.14}, pi * 0.025 * 0.025 * 0.14, 0.005 * pi * 0.025 * 0.025 * 0.14, 2},
        Known{"dumbbell", {R, r, apart}, dumbbell_m3, 0.005 * dumbbell_m3, 2},
        Known{"knobbed_cylinder", {R, 0.08, n, 0.02, k}, knobbed_m3, 0.005 * knobbed_m3, 2},
        Known{"bowl", {0.06, 0.006}, bowl_m3, 0.005 * ball / 2 * std::pow(0.06, 3), 2},
        Known{"ring_on_bar", {0.006}, 192 * std::pow(0.006, 3), rounding * std::pow(0.1, 3), 0},
        Known{"box", {0.1, 0.2, 0.3}, 0.006, rounding * 0.006, 2}}) {
    const auto report = geometry::check_mesh(make_shape(known.name, known.size_m));
    EXPECT_EQ(geometry::flaw(report), "") << known.name;
    EXPECT_EQ(report.euler, known.euler) << known.name;
    EXPECT_EQ(report.components, 1) << known.name;
    EXPECT_NEAR(report.volume_m3, known.volume_m3, known.tolerance_m3) << known.name;
  }
}

TEST(Shapes, ThatCannotBeAreRefused) {
  const auto sentence = [](const std::string& name, const std::vector<double>& size_m) -> std::string {
    try {
      make_shape(name, size_m);
    } catch (const pipeline::UserError& error) {
      return error.sentence();
    }
    return "";
  };
  EXPECT_NE(sentence("spere", {1}).find("no shape 'spere'"), std::string::npos);
  EXPECT_NE(sentence("torus", {1}).find("has 2 sizes, not 1"), std::string::npos);
  EXPECT_NE(sentence("torus", {0.01, 0.02}).find("thinner"), std::string::npos);
  EXPECT_NE(sentence("dumbbell", {0.03, 0.01, 0.05}).find("farther apart"), std::string::npos);
  EXPECT_NE(sentence("sphere", {-1}).find("above 0"), std::string::npos);
}

}  // namespace
}  // namespace geocage::datasets
