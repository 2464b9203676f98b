#include "geometry/surface_distance.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>
#include <omp.h>

#include "datasets/shapes.h"

namespace geocage::geometry {
namespace {

TriangleMesh moved(TriangleMesh mesh, const Vec3& by) {
  for (Vec3& p : mesh.vertices) p += by;
  return mesh;
}

TEST(SurfaceDistance, FootOnABoxIsTheClampedPoint) {
  const SurfaceDistance surface(datasets::box({2, 2, 2}, 3));
  int nearest = 0;
  for (const Vec3& p : {Vec3(3, 0.2, -0.3), Vec3(1.5, -1.4, 0.3), Vec3(-2, 2, 5), Vec3(0.2, 0.8, 0.1)}) {
    Vec3 expected = p.cwiseMax(-1).cwiseMin(1);
    if (expected == p) expected.y() = 1;  // the last one is inside, nearest to that side
    const auto foot = surface.foot(p, nearest);
    EXPECT_LT((foot.point_O - expected).norm(), 1e-12);
    EXPECT_NEAR(foot.distance_m, (p - expected).norm(), 1e-12);
    // The weights of the corners give the foot back: they add up to one.
    EXPECT_NEAR(surface.barycentric(foot.point_O, nearest).sum(), 1, 1e-12);
  }
}

// The middle of a cube is as far from all of its sides, and each side's middle is a corner of triangles: all
// in whole numbers, so that distances are alike to the last bit.
TEST(SurfaceDistance, OfSeveralNearestTheFirstIsNamedWhereverTheSearchBegins) {
  const auto cube = datasets::box({2, 2, 2}, 4);
  const SurfaceDistance surface(cube);
  const int last = static_cast<int>(cube.triangles.size()) - 1;
  for (const Vec3& p : {Vec3(0, 0, 0), Vec3(3, 0, 0), Vec3(0, -2, 0), Vec3(2, 2, 2)}) {
    std::vector<double> distances2;
    for (const auto& t : cube.triangles)
      distances2.push_back(
          Facet(cube.vertices[t[0]], cube.vertices[t[1]], cube.vertices[t[2]]).distance2(p, 1e9));
    const int first = static_cast<int>(std::ranges::min_element(distances2) - distances2.begin());
    EXPECT_GT(std::ranges::count(distances2, distances2[first]), 1);
    for (int begin : {0, first, last / 2, last}) {
      int nearest = begin;
      surface.distance_m(p, nearest);
      EXPECT_EQ(nearest, first) << p.transpose() << " from " << begin;
    }
  }
}

TEST(SurfaceDistance, FacingFootStaysOnItsSideOfAThinWall) {
  const SurfaceDistance surface(datasets::box({1, 1, 0.01}, 4));
  int nearest = 0;
  const Vec3 p(0.1, 0.2, -0.004);  // nearest to the lower side
  EXPECT_NEAR(surface.foot(p, nearest).point_O.z(), -0.005, 1e-12);
  EXPECT_NEAR(surface.foot_facing(p, Vec3::UnitZ(), 0, 0.1, nearest)->point_O.z(), 0.005, 1e-12);
  EXPECT_FALSE(surface.foot_facing(p, Vec3::UnitZ(), 0, 0.008, nearest));  // it is 9 mm away
}

TEST(Deviation, ConcentricBalls) {
  const double r = 1, gap = 0.1;
  const auto inner = datasets::icosphere(r, 4), outer = datasets::icosphere(r + gap, 4);
  const SurfaceDistance to_inner(inner), to_outer(outer);
  // Facets lie inside their balls by at most edge^2 / 6 (the circumscribed circle of an edge of 0.08): 1e-3.
  for (const auto& side : {deviation(inner, to_outer, 0.02), deviation(outer, to_inner, 0.02)}) {
    EXPECT_NEAR(side.mean_m, gap, 1.1e-3);
    EXPECT_NEAR(side.rms_m, gap, 1.1e-3);
    EXPECT_NEAR(side.max_m, gap, 1.1e-3);
    EXPECT_GE(side.rms_m, side.mean_m);
  }
}

TEST(Deviation, ParallelSquaresInClosedForm) {
  // A unit square and its copy shifted by (s, 0, 0) in its own plane: the points of the strip that sticks out
  // are x away, x uniform in [0, s]: mean s^2 / 2, mean square s^3 / 3, maximum s (at vertices, exactly).
  const double s = 0.25, spacing = 0.004;
  const auto square = datasets::flat_grid(1, 4);
  const auto d = deviation(square, SurfaceDistance(moved(square, {s, 0, 0})), spacing);
  EXPECT_NEAR(d.max_m, s, 1e-7);                  // the tree is in single precision, the distance is not
  EXPECT_NEAR(d.mean_m, s * s / 2, s * spacing);  // midpoint rule
  EXPECT_NEAR(std::pow(d.rms_m, 2), std::pow(s, 3) / 3, s * s * spacing);
}

TEST(Deviation, OneSideMaySeeWhatTheOtherDoesNot) {
  auto with_island = datasets::icosphere(0.1, 2);
  const SurfaceDistance ball(with_island);
  const auto island = moved(datasets::icosphere(0.01, 1), {0.5, 0, 0});
  EXPECT_LT(deviation(with_island, ball, 0.01).max_m, 1e-9);
  EXPECT_NEAR(deviation(island, ball, 0.01).max_m, 0.5 + 0.01 - 0.1, 2e-3);
}

TEST(Deviation, SameBytesForAnyNumberOfThreads) {
  const auto a = datasets::torus(1, 0.3, 60, 20);
  const SurfaceDistance b(datasets::torus(1, 0.31, 50, 18));
  std::array<Deviation, 2> d;
  const int before = omp_get_max_threads();
  for (int i : {0, 1}) {
    omp_set_num_threads(i == 0 ? 1 : 4);
    d[i] = deviation(a, b, 0.02);
  }
  omp_set_num_threads(before);
  EXPECT_EQ(d[0].rms_m, d[1].rms_m);
  EXPECT_EQ(d[0].mean_m, d[1].mean_m);
  EXPECT_EQ(d[0].max_m, d[1].max_m);
}

}  // namespace
}  // namespace geocage::geometry
