#include "topology/writhe.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "tests/topology/curves.h"
namespace geocage::topology {
namespace {

using geometry::Pose;

/// Gauss's double integral (thesis eq. 2.1) by the midpoint rule with n x n cells: error O(1 / n^2).
double quadrature(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d, int n) {
  double sum = 0;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) {
      const Vec3 r = a + (i + 0.5) / n * (b - a) - c - (j + 0.5) / n * (d - c);
      sum += (b - a).cross(d - c).dot(r) / std::pow(r.norm(), 3);
    }
  return sum / n / n;
}

const Vec3 a(0, 0, 0), b(1, 0, 0), c(.3, -.4, .5), d(.9, .8, .7);

TEST(SegmentWrithe, CrossAtHeightH) {
  for (double h : {1.0, 2.0, 0.5, 0.1})
    EXPECT_NEAR(segment_writhe({-1, 0, 0}, {1, 0, 0}, {0, -1, h}, {0, 1, h}), -4 * std::asin(1 / (1 + h * h)),
                1e-12);
  EXPECT_NEAR(gauss_linking_integral({{-1, 0, 0}, {1, 0, 0}}, {{0, -1, 1}, {0, 1, 1}}), -1.0 / 6, 1e-12);
}

TEST(SegmentWrithe, CrossOfTwoLengths) {
  EXPECT_NEAR(std::abs(segment_writhe({-1, 0, 0}, {1, 0, 0}, {0, -2, 1}, {0, 2, 1})),
              4 * std::asin(2 / std::sqrt(10.0)), 1e-12);
}

TEST(SegmentWrithe, IsTheDoubleIntegral) {
  EXPECT_NEAR(segment_writhe(a, b, c, d), -1.818181179383, 1e-11);
  EXPECT_NEAR(segment_writhe({.1, .2, 0}, {1, 0, .1}, c, d), -2.079207968851, 1e-11);
  // Second derivatives of the integrand are of size 1 / gap^4 = 2^4 .. 2^5; over 24 n^2 at n = 400: 1e-5.
  EXPECT_NEAR(segment_writhe(a, b, c, d), quadrature(a, b, c, d, 400), 1e-5);
}

TEST(SegmentWrithe, Symmetries) {
  const double omega = segment_writhe(a, b, c, d);
  EXPECT_NEAR(segment_writhe(c, d, a, b), omega, 1e-14);
  EXPECT_NEAR(segment_writhe(b, a, c, d), -omega, 1e-14);
  EXPECT_NEAR(segment_writhe(a, b, d, c), -omega, 1e-14);
  EXPECT_NEAR(segment_writhe(b, a, d, c), omega, 1e-14);
  const auto mirror = [](const Vec3& p) { return Vec3(p.x(), -p.y(), p.z()); };
  EXPECT_NEAR(segment_writhe(mirror(a), mirror(b), mirror(c), mirror(d)), -omega, 1e-14);
  const Pose X(Eigen::Translation3d(3, -2, 1) * Eigen::AngleAxisd(0.7, Vec3(1, 2, 3).normalized()));
  const auto moved = [&](const Vec3& p) -> Vec3 { return X * (0.01 * p); };
  // Coordinates of 3 hold points of a 0.01 figure: 3 eps / 0.01 = 7e-14 relative, a few of them.
  EXPECT_NEAR(segment_writhe(moved(a), moved(b), moved(c), moved(d)), omega, 1e-12);
}

TEST(SegmentWrithe, TouchingIsKnown) {
  const Vec3 o(0.1, 0.2, 0.3), x(1, 2, 2), y(2, 1, -2);  // coordinates that are rounded
  const auto at = [&](double u, double v) -> Vec3 { return o + 0.3 * (u * x + v * y); };
  EXPECT_TRUE(segments_touch(at(-1, 0), at(1, 0), at(0, -1), at(0, 1)));        // crossed at their middles
  EXPECT_TRUE(segments_touch(at(-1, 0), at(2, 0), at(0.3, -1), at(0.1, 0.7)));  // crossed anywhere
  EXPECT_TRUE(segments_touch(at(-1, 0), at(1, 0), at(0, 0), at(0, 1)));         // a T
  EXPECT_TRUE(segments_touch(at(0, 0), at(1, 0), at(1, 0), at(1, 1)));          // one end of both
  EXPECT_TRUE(segments_touch(at(0, 0), at(2, 0), at(1, 0), at(3, 0)));          // overlapping
  EXPECT_TRUE(segments_touch(at(0, 0), at(1, 0), at(0, 0), at(1, 0)));          // the same
  EXPECT_TRUE(segments_touch(at(0, 0), at(2, 0), at(1, 0), at(1, 0)));          // a point on a segment
  EXPECT_FALSE(segments_touch(at(0, 0), at(1, 0), at(2, 0), at(3, 0)));         // in one line, apart
  EXPECT_FALSE(segments_touch(at(0, 0), at(1, 0), at(0, 1), at(1, 1)));         // parallel
  EXPECT_FALSE(segments_touch(at(0, 0), at(1, 0), at(2, -1), at(2, 1)));        // in one plane, apart
  EXPECT_FALSE(segments_touch(at(0, 0), at(1, 0), at(2, 1), at(2, 1)));         // a point beside a segment
  const Vec3 up = 1e-9 * x.cross(y).normalized();
  EXPECT_FALSE(segments_touch(at(-1, 0), at(1, 0), at(0, -1) + up, at(0, 1) + up));
}

TEST(SegmentWrithe, SegmentsInOnePlaneSeeNothing) {
  EXPECT_EQ(segment_writhe({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}), 0);     // parallel
  EXPECT_EQ(segment_writhe({0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}), 0);     // in one line
  EXPECT_EQ(segment_writhe({0, 0, 0}, {1, 0, 0}, {1, 0, 0}, {1, 1, 1}), 0);     // shared end
  EXPECT_EQ(segment_writhe({0, 0, 0}, {0, 0, 0}, {1, 0, 0}, {1, 1, 1}), 0);     // no length
  EXPECT_EQ(segment_writhe({0, 0, 0}, {1, 0, 0}, {2, -1, 0}, {2.5, 3, 0}), 0);  // disjoint
}

TEST(SegmentWrithe, NearlyCrossing) {
  EXPECT_NEAR(segment_writhe({-1, 0, 0}, {1, 0, 0}, {-1, 1, 0}, {1, -1, 1e-9}), 2 * M_PI, 1e-6);
}

TEST(Link, HopfLinkIsMinusOneHoweverCoarse) {
  for (int n : {3, 4, 8, 32}) {
    const auto first = ring(n);
    const auto second = closed_polyline(n, [](double t) { return Vec3(1 + std::cos(t), 0, std::sin(t)); });
    EXPECT_NEAR(gauss_linking_integral(first, second), -1, 1e-12) << n;
    EXPECT_NEAR(gauss_linking_integral(first, reversed(second)), 1, 1e-12) << n;
  }
}

TEST(Link, HopfSquares) {
  const Polyline first = {{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}, {-1, -1, 0}};
  const Polyline second = {{0, 0, -1}, {2, 0, -1}, {2, 0, 1}, {0, 0, 1}, {0, 0, -1}};
  EXPECT_NEAR(gauss_linking_integral(first, second), -1, 1e-12);
}

TEST(Link, CirclesApartAreNotLinked) {
  const auto far = closed_polyline(32, [](double t) { return Vec3(5 + std::cos(t), 0, std::sin(t)); });
  EXPECT_NEAR(gauss_linking_integral(ring(32), far), 0, 1e-12);
}

TEST(Link, SegmentThroughACircle) {
  // H / sqrt(H^2 + 1) for the circle; the polygon of 256 sides adds 2 pi^2 / (3 n^2) of order 1e-5.
  const Polyline axis = {{0, 0, -1}, {0, 0, 1}};
  EXPECT_NEAR(std::abs(gauss_linking_integral(ring(256), axis)), 0.707124530, 1e-8);
  EXPECT_NEAR(std::abs(gauss_linking_integral(ring(4096), axis)), std::sqrt(0.5), 1e-6);
}

TEST(WritheMatrix, RowsAreSegmentsOfTheFirst) {
  const Polyline first = {a, b, {1, 1, .2}}, second = {c, d, {2, 0, 1}, {0, 3, 1}};
  const auto omega = writhe_matrix(first, second);
  ASSERT_EQ(omega.rows(), 2);
  ASSERT_EQ(omega.cols(), 3);
  EXPECT_EQ(omega(1, 2), segment_writhe(first[1], first[2], second[2], second[3]));
  EXPECT_LT((omega.transpose() - writhe_matrix(second, first)).norm(), 1e-14);
}

TEST(Writhe, PlaneCurvesHaveNone) {
  auto curve = ring(17);
  curve.pop_back();
  EXPECT_NEAR(writhe_of_closed(curve), 0, 1e-12);
}

TEST(Writhe, Trefoil) {
  const auto trefoil = [](int n) {
    auto curve = closed_polyline(n, [](double t) {
      return Vec3(std::sin(t) + 2 * std::sin(2 * t), std::cos(t) - 2 * std::cos(2 * t), -std::sin(3 * t));
    });
    curve.pop_back();
    return curve;
  };
  EXPECT_NEAR(writhe_of_closed(trefoil(100)), -3.354225047, 1e-8);
  EXPECT_NEAR(writhe_of_closed(trefoil(400)), -3.354132419, 1e-8);
}

}  // namespace
}  // namespace geocage::topology
