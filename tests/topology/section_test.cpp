#include "topology/section.h"

#include <cmath>
#include <numeric>

#include <gtest/gtest.h>

#include "datasets/shapes.h"

namespace geocage::topology {
namespace {

Section cut(const geometry::TriangleMesh& mesh, const std::vector<int>& triangles, const Vec3& p,
            const Vec3& center, const Vec3& axis) {
  const NumberedEdges edges(mesh);
  return Cutter(mesh, edges).cut(triangles, p, center, axis);
}

using geometry::TriangleMesh;

std::vector<int> all_triangles(const TriangleMesh& mesh) {
  std::vector<int> ids(mesh.triangles.size());
  std::iota(ids.begin(), ids.end(), 0);
  return ids;
}

double length(const Section& section) {
  double sum = section.closed ? (section.path.back() - section.path.front()).norm() : 0;
  for (std::size_t i = 1; i < section.path.size(); ++i) sum += (section.path[i] - section.path[i - 1]).norm();
  return sum;
}

TEST(Section, SphereIsCutInACircle) {
  const auto mesh = datasets::icosphere(1, 4);
  const Vec3 axis = Vec3(1, 2, 3).normalized();
  const Section section = cut(mesh, all_triangles(mesh), mesh.vertices[0], 0.3 * axis, axis);
  EXPECT_TRUE(section.closed);
  for (const Vec3& p : section.path) EXPECT_NEAR(axis.dot(p), 0.3, 1e-12);  // 1e-11 of an edge below
  // Chords of at most 0.09 lie inside the circle by 0.09^2 / 8 = 1e-3 of the radius.
  EXPECT_NEAR(length(section), 2 * M_PI * std::sqrt(1 - 0.09), 1e-3 * 2 * M_PI);
}

TEST(Section, VerticesOnThePlaneAreNoGap) {
  const auto mesh = datasets::octahedron();  // the plane z = 0 holds four vertices and four edges
  const Section section = cut(mesh, all_triangles(mesh), mesh.vertices[0], Vec3::Zero(), Vec3::UnitZ());
  EXPECT_TRUE(section.closed);
  EXPECT_NEAR(length(section), 4, 1e-9);  // eight points, each within 1e-11 of an edge
  EXPECT_EQ(winding_angle_rad(section, Vec3::Zero(), Vec3::UnitZ()), 2 * M_PI);
}

TEST(Section, OnlyTheGivenTriangles) {
  const auto mesh = datasets::open_tube(1, 1, 64, 8);
  std::vector<int> half;
  for (int f : all_triangles(mesh)) {
    const auto& t = mesh.triangles[f];
    if ((mesh.vertices[t[0]] + mesh.vertices[t[1]] + mesh.vertices[t[2]]).y() > 0) half.push_back(f);
  }
  const Section section = cut(mesh, half, {0, 1, 0}, {0, 0, 0.01}, Vec3::UnitZ());
  EXPECT_FALSE(section.closed);
  // A half turn, with ends off by a triangle: at most one column, 2 pi / 64, each.
  EXPECT_NEAR(length(section), M_PI, 2 * 0.1);
}

TEST(Section, ThePieceNearestToTheVertex) {
  auto mesh = datasets::icosphere(1, 3);
  const auto one = mesh;
  const int count = static_cast<int>(one.vertices.size());
  for (const Vec3& p : one.vertices) mesh.vertices.push_back(p + Vec3(5, 0, 0));
  for (const auto& t : one.triangles) mesh.triangles.push_back({t[0] + count, t[1] + count, t[2] + count});
  for (double x : {0.0, 5.0}) {
    const Section section = cut(mesh, all_triangles(mesh), {x, 1, 0}, {2.5, 0, 0.1}, Vec3::UnitZ());
    Vec3 mean = Vec3::Zero();
    for (const Vec3& p : section.path) mean += p / static_cast<double>(section.path.size());
    EXPECT_NEAR(mean.x(), x, 0.1);
  }
}

TEST(Section, MissedIsEmpty) {
  const auto mesh = datasets::cube();
  const Section section = cut(mesh, all_triangles(mesh), Vec3::Zero(), {0, 0, 3}, Vec3::UnitZ());
  EXPECT_TRUE(section.path.empty());
  EXPECT_TRUE(std::isnan(winding_angle_rad(section, {0, 0, 3}, Vec3::UnitZ())));
}

/// Arc of the unit circle from -alpha to alpha, seen from its centroid.
double winding_of_arc(double alpha) {
  Section arc;
  for (int i = 0; i < 1000; ++i) {
    const double t = alpha * (2 * i / 999.0 - 1);
    arc.path.emplace_back(std::cos(t), std::sin(t), 0);
  }
  return winding_angle_rad(arc, {std::sin(alpha) / alpha, 0, 0}, Vec3::UnitZ());
}

TEST(WindingAngle, OfAnArcAroundItsCentroid) {
  const std::vector<std::pair<double, double>> known = {{0.5, 3.477424847},      {M_PI / 4, 3.675050242},
                                                        {M_PI / 2, 4.275415663}, {2.0, 4.669137448},
                                                        {2.5, 5.239277017},      {3.0, 6.012685633}};
  for (const auto& [alpha, w] : known) {
    EXPECT_NEAR(winding_of_arc(alpha), w, 1e-9);
    EXPECT_NEAR(winding_of_arc(alpha),
                2 * M_PI - 2 * std::atan2(std::sin(alpha), std::sin(alpha) / alpha - std::cos(alpha)), 1e-12);
  }
  EXPECT_NEAR(winding_of_arc(1e-3), M_PI, 1e-3);
  EXPECT_NEAR(winding_of_arc(M_PI), 2 * M_PI, 1e-9);
}

TEST(WindingAngle, NeverMoreThanATurnNorLessThanHalf) {
  Section spiral, far;
  for (int i = 0; i <= 100; ++i) {
    const double t = 3 * M_PI * i / 100;
    spiral.path.emplace_back(std::cos(t), std::sin(t), 0);
    far.path.emplace_back(10, i / 100.0, 0);
  }
  EXPECT_EQ(winding_angle_rad(spiral, Vec3::Zero(), Vec3::UnitZ()), 2 * M_PI);
  EXPECT_EQ(winding_angle_rad(far, Vec3::Zero(), Vec3::UnitZ()), M_PI);
}

}  // namespace
}  // namespace geocage::topology
