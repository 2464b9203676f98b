#include "topology/loops.h"

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <numeric>
#include <random>
#include <set>

#include <gtest/gtest.h>
#include <omp.h>

#include "datasets/shapes.h"
#include "geometry/mesh_files.h"
#include "tests/topology/curves.h"
#include "topology/linking.h"

namespace geocage::topology {
namespace {

using geometry::Pose;
using geometry::TriangleMesh;

constexpr double R = 0.05, r = 0.015;
constexpr int nu = 60, nv = 20;

/// Perimeters of the polygons that a torus's circles are on its mesh.
double polygon_m(double radius_m, int n) {
  return 2 * n * radius_m * std::sin(M_PI / n);
}
/// The surface of a torus's mesh comes nearer to the axis than its vertices by the factor cos(pi / nu), and
/// to the tube's core by cos(pi / nv): loops may be shorter than polygons by that, never longer.
void expect_length(double length_m, double polygon) {
  EXPECT_LE(length_m, polygon * (1 + 1e-12));
  EXPECT_GE(length_m, polygon * std::cos(M_PI / nu) * std::cos(M_PI / nv));
}

Polyline circle(const Vec3& center, double radius_m, const Vec3& x, const Vec3& y) {
  Polyline points;
  for (int i = 0; i < 90; ++i) {
    const double t = 2 * M_PI * i / 90;
    points.push_back(center + radius_m * (std::cos(t) * x + std::sin(t) * y));
  }
  return points;
}
/// Inside the tube; and round the tube, outside of it.
Polyline core(const Vec3& center = Vec3::Zero()) {
  return circle(center, R, Vec3::UnitX(), Vec3::UnitY());
}
Polyline outer(const Vec3& center = Vec3::Zero()) {
  return circle(center + Vec3(0, R, 0), 1.5 * r, Vec3::UnitY(), Vec3::UnitZ());
}

int links(const SurfaceLoop& loop, const Polyline& curve) {
  const auto link = linking_number(loop.path, curve);
  EXPECT_LT(link.residual, 1e-9);
  return std::abs(link.value);
}

int count(const std::vector<SurfaceLoop>& loops, LoopKind kind) {
  return static_cast<int>(
      std::count_if(loops.begin(), loops.end(), [&](const auto& l) { return l.kind == kind; }));
}

/// The same surface by other points: columns and rows of the grid are no circles any more.
TriangleMesh jittered_torus(std::uint64_t seed) {
  TriangleMesh mesh = datasets::torus(R, r, nu, nv);
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<> share(-0.3, 0.3);
  for (Vec3& p : mesh.vertices) {
    const double u = std::atan2(p.y(), p.x()) + 2 * M_PI / nu * share(random),
                 v = std::atan2(p.z(), std::hypot(p.x(), p.y()) - R) + 2 * M_PI / nv * share(random);
    p = {(R + r * std::cos(v)) * std::cos(u), (R + r * std::cos(v)) * std::sin(u), r * std::sin(v)};
  }
  return mesh;
}

TEST(HandleLoops, OfATorusAreItsCircles) {
  const auto loops = handle_loops(datasets::torus(R, r, nu, nv));
  ASSERT_EQ(loops.size(), 2u);
  EXPECT_EQ(loops[0].kind, LoopKind::around);
  EXPECT_EQ(loops[1].kind, LoopKind::through);
  expect_length(loops[0].length_m, polygon_m(r, nv));
  expect_length(loops[1].length_m, polygon_m(R - r, nu));
  EXPECT_EQ(links(loops[0], core()), 1);
  EXPECT_EQ(links(loops[0], outer()), 0);
  EXPECT_EQ(links(loops[1], core()), 0);
  EXPECT_EQ(links(loops[1], outer()), 1);
}

// Where the tube is thick the loop through the hole is the shorter one.
TEST(HandleLoops, OfAThickTorus) {
  const auto loops = handle_loops(datasets::torus(0.03, 0.02, nu, nv * 2));
  ASSERT_EQ(loops.size(), 2u);
  EXPECT_EQ(loops[0].kind, LoopKind::through);
  expect_length(loops[0].length_m, polygon_m(0.01, nu));
  EXPECT_EQ(loops[1].kind, LoopKind::around);
  expect_length(loops[1].length_m, polygon_m(0.02, nv * 2));
}

// Edges zigzag about circles and are 5 to 15 % longer; what is left after pulling is the mesh's own error,
// cells being up to 1.6 times as large.
TEST(HandleLoops, AreTightOnUnevenMeshes) {
  for (std::uint64_t seed : {1, 2, 3}) {
    const auto loops = handle_loops(jittered_torus(seed));
    ASSERT_EQ(loops.size(), 2u);
    const double error = std::pow(1.6 * M_PI / nv, 2) / 2 + std::pow(1.6 * M_PI / nu, 2) / 2;
    EXPECT_NEAR(loops[0].length_m, 2 * M_PI * r, error * 2 * M_PI * r) << seed;
    EXPECT_NEAR(loops[1].length_m, 2 * M_PI * (R - r), error * 2 * M_PI * (R - r)) << seed;
    EXPECT_EQ(links(loops[0], core()), 1);
    EXPECT_EQ(links(loops[1], outer()), 1);
  }
}

TEST(HandleLoops, StripsAreRingsOfTriangles) {
  for (const TriangleMesh& mesh : {datasets::torus(R, r, nu, nv), jittered_torus(3)}) {
    const NumberedEdges numbered(mesh);
    for (const SurfaceLoop& loop : handle_loops(mesh)) {
      std::set<int> vertices, edges;
      for (std::size_t i = 0; i < loop.strip.size(); ++i) {
        const int face = loop.strip[i], next = loop.strip[(i + 1) % loop.strip.size()];
        const auto &here = numbered.of[face], &there = numbered.of[next];
        EXPECT_TRUE(std::ranges::any_of(here, [&](int e) { return std::ranges::count(there, e) > 0; }));
        vertices.insert(mesh.triangles[face].begin(), mesh.triangles[face].end());
        edges.insert(here.begin(), here.end());
      }
      EXPECT_EQ(std::set(loop.strip.begin(), loop.strip.end()).size(), loop.strip.size());
      EXPECT_EQ(std::ssize(vertices) - std::ssize(edges) + std::ssize(loop.strip), 0);  // Euler's, of a band
    }
  }
}

TEST(HandleLoops, WithoutAHandleThereAreNone) {
  for (const auto& mesh :
       {datasets::icosphere(R, 3), datasets::cup(0.04, 0.1, 0.003, 32), datasets::tetrahedron()})
    EXPECT_TRUE(handle_loops(mesh).empty());
}

TEST(HandleLoops, OfTwoToriAreTwicePairs) {
  const auto mesh = datasets::double_torus(R, r, nu, nv);
  const auto loops = handle_loops(mesh);
  ASSERT_EQ(loops.size(), 4u);
  EXPECT_EQ(count(loops, LoopKind::around), 2);
  EXPECT_EQ(count(loops, LoopKind::through), 2);
  const double apart = R + r + M_PI * r / nv;
  const Vec3 left(-apart, 0, 0), right(apart, 0, 0);
  // Independent: around loops see the cores as a matrix of determinant 1 does, through loops the outer ones.
  for (LoopKind kind : {LoopKind::around, LoopKind::through}) {
    Eigen::Matrix2i link;
    int i = 0;
    for (const auto& loop : loops) {
      if (loop.kind != kind) continue;
      const bool around = kind == LoopKind::around;
      expect_length(loop.length_m, around ? polygon_m(r, nv) : polygon_m(R - r, nu));
      link(i, 0) = links(loop, around ? core(left) : outer(left));
      link(i, 1) = links(loop, around ? core(right) : outer(right));
      ++i;
    }
    EXPECT_EQ(std::abs(link(0, 0) * link(1, 1) - link(0, 1) * link(1, 0)), 1) << link;
  }
}

TEST(HandleLoops, OfTwoSeparatePieces) {
  TriangleMesh mesh = datasets::torus(R, r, nu, nv);
  const auto other = datasets::torus(R, 0.8 * r, nu, nv);
  const int before = static_cast<int>(mesh.vertices.size());
  for (const Vec3& p : other.vertices) mesh.vertices.push_back(p + Vec3(1, 0, 0));
  for (const auto& [a, b, c] : other.triangles)
    mesh.triangles.push_back({a + before, b + before, c + before});
  const auto loops = handle_loops(mesh);
  ASSERT_EQ(loops.size(), 4u);
  expect_length(loops[0].length_m, polygon_m(0.8 * r, nv));
  expect_length(loops[1].length_m, polygon_m(r, nv));
}

TEST(HandleLoops, LengthsFollowMotionsScalesAndNewNumbers) {
  const auto mesh = jittered_torus(4);
  const auto loops = handle_loops(mesh);
  const Pose X(Eigen::Translation3d(0.3, -0.2, 0.1) * Eigen::AngleAxisd(0.7, Vec3(1, 2, 3).normalized()));
  std::vector<int> renamed(mesh.vertices.size());
  std::iota(renamed.begin(), renamed.end(), 0);
  std::shuffle(renamed.begin(), renamed.end(), std::mt19937_64(5));
  TriangleMesh other = mesh;
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
    other.vertices[renamed[v]] = X * (2 * mesh.vertices[v]);
  for (auto& t : other.triangles)
    for (int& v : t) v = renamed[v];
  std::shuffle(other.triangles.begin(), other.triangles.end(), std::mt19937_64(6));
  const auto others = handle_loops(other);
  ASSERT_EQ(others.size(), loops.size());
  // Pulling stops when crossings move by less than 1e-10 of an edge, each sweep leaving a share of the rest.
  for (std::size_t i = 0; i < loops.size(); ++i) {
    EXPECT_EQ(others[i].kind, loops[i].kind);
    EXPECT_NEAR(others[i].length_m, 2 * loops[i].length_m, 1e-4 * loops[i].length_m);
  }
}

TEST(HandleLoops, SameForAnyThreadCount) {
  const auto mesh = datasets::double_torus(R, r, nu, nv);
  std::vector<std::vector<SurfaceLoop>> all;
  for (int threads : {1, 2, 5}) {
    omp_set_num_threads(threads);
    all.push_back(handle_loops(mesh));
  }
  omp_set_num_threads(omp_get_num_procs());
  for (const auto& loops : all) {
    ASSERT_EQ(loops.size(), all[0].size());
    for (std::size_t i = 0; i < loops.size(); ++i) EXPECT_EQ(loops[i].path, all[0][i].path);
  }
}

TEST(SectionLoop, OfASphereIsACircle) {
  const auto sphere = datasets::icosphere(R, 5);
  const Vec3 axis = Vec3(1, 2, 3).normalized();
  for (double h : {0.0, 0.013, -0.03}) {
    const auto loop = section_loop(sphere, NumberedEdges(sphere), Vec3(0, 0, R), h * axis, axis);
    ASSERT_TRUE(loop);
    const double circle_m = 2 * M_PI * std::sqrt(R * R - h * h);
    // Triangles of edge e lie up to e^2 / 8 R inside the sphere, and cut its circles by that over tan of the
    // latitude; e = R / 28.
    EXPECT_NEAR(loop->length_m, circle_m, 5e-4 * circle_m);
  }
  EXPECT_FALSE(section_loop(sphere, NumberedEdges(sphere), Vec3(0, 0, R), 2 * R * axis, axis));
}

TEST(SectionLoop, TakesThePieceNearestToP) {
  const auto torus = datasets::torus(R, r, nu, nv);  // the plane x = 0 cuts it into two circles
  for (double side : {-1.0, 1.0}) {
    const auto loop =
        section_loop(torus, NumberedEdges(torus), Vec3(0.001, side * R, r), Vec3(1e-6, 0, 0), Vec3::UnitX());
    ASSERT_TRUE(loop);
    EXPECT_GT(side * loop->path[0].y(), 0);
    EXPECT_NEAR(loop->length_m, polygon_m(r, nv), 1e-3 * polygon_m(r, nv));  // pi / nu = 0.05: second order
  }
}

/// A body of revolution whose radius is least, `neck_m`, at z = 0.
TriangleMesh hourglass(double neck_m) {
  auto mesh = datasets::capped_cylinder(1, 4, 40);
  for (Vec3& p : mesh.vertices) p.head<2>() *= neck_m + 0.1 * p.z() * p.z();
  return mesh;
}

TEST(NeckLoop, SlipsIntoTheNeck) {
  const auto mesh = hourglass(0.5);
  const Vec3 axis = Vec3(0.3, 0.1, 1).normalized();
  const auto section = section_loop(mesh, NumberedEdges(mesh), Vec3(0.7, 0, 0.9), Vec3(0, 0, 0.9), axis);
  const auto neck = neck_loop(mesh, NumberedEdges(mesh), Vec3(0.7, 0, 0.9), Vec3(0, 0, 0.9), axis);
  ASSERT_TRUE(section && neck);
  const double wanted = polygon_m(0.5, 40);
  EXPECT_GT(section->length_m, 1.1 * wanted);
  // Rows are 0.16 apart: none need lie at the neck, where the radius is 0.5 + 0.1 z^2.
  EXPECT_NEAR(neck->length_m, wanted, 0.1 * 0.08 * 0.08 / 0.5 * wanted + 1e-6);
  for (const Vec3& p : neck->path) EXPECT_LT(std::abs(p.z()), 0.17);
}

TEST(NeckLoop, SlipsOffWhereThereIsNone) {
  const auto sphere = datasets::icosphere(R, 4);
  EXPECT_FALSE(neck_loop(sphere, NumberedEdges(sphere), Vec3(0, 0, R), Vec3(0, 0, 0.01),
                         Vec3(0.1, 0, 1).normalized()));
  const auto egg = [&] {
    auto mesh = sphere;
    for (Vec3& p : mesh.vertices) p.z() *= 1.5;
    return mesh;
  }();
  EXPECT_FALSE(neck_loop(egg, NumberedEdges(egg), Vec3(R, 0, 0.03), Vec3(0, 0, 0.03), Vec3::UnitZ()));
}

// The joint between the two tori is a three-sided prism along x: its neck is what a plane x = 0 cuts, the
// shadow of its end, whichever way the ring is put on.
TEST(NeckLoop, OfTheJointOfTwoTori) {
  const auto mesh = datasets::double_torus(R, r, nu, nv);
  const auto neck =
      neck_loop(mesh, NumberedEdges(mesh), Vec3(0, 0, 0), Vec3(1e-4, 0, 0), Vec3(1, 0.1, 0).normalized());
  ASSERT_TRUE(neck);
  Polyline shadow;
  for (int side : {6, 4, 2}) shadow.push_back(mesh.vertices[(*(mesh.triangles.end() - side))[0]]);
  for (Vec3& p : shadow) p.x() = 0;
  const double perimeter =
      (shadow[0] - shadow[1]).norm() + (shadow[1] - shadow[2]).norm() + (shadow[2] - shadow[0]).norm();
  EXPECT_NEAR(neck->length_m, perimeter, 1e-8);
}

/// Foreign meshes, of which genus and size are known.
class ObjectLoops : public testing::Test {
 protected:
  void SetUp() override {
    const char* folder = std::getenv("GEOCAGE_TEST_OBJECTS");
    if (!folder) GTEST_SKIP() << "GEOCAGE_TEST_OBJECTS is not set";
    folder_ = folder;
  }
  std::filesystem::path folder_;
};

TEST_F(ObjectLoops, OfTheElephantAreThreePairs) {
  const auto mesh = geometry::read_mesh(folder_ / "elephant.off", 0.14);
  const auto loops = handle_loops(mesh);
  ASSERT_EQ(loops.size(), 6u);  // genus 3
  EXPECT_EQ(count(loops, LoopKind::around), 3);
  for (const auto& loop : loops) EXPECT_LT(loop.length_m, 2 * geometry::check_mesh(mesh).diagonal_m());
}

TEST_F(ObjectLoops, OfTheMugGoRoundItsHandleAndThroughIt) {
  const auto loops = handle_loops(geometry::read_mesh(folder_ / "mug.stl"));
  ASSERT_EQ(loops.size(), 2u);
  EXPECT_NE(loops[0].kind, loops[1].kind);
  for (const auto& loop : loops) {
    EXPECT_GT(loop.length_m, 0.02);  // a finger's width is 2 cm, a mug 0.1 m high
    EXPECT_LT(loop.length_m, 0.3);
  }
}

}  // namespace
}  // namespace geocage::topology
