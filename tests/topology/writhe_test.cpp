#include "topology/writhe.h"

#include <algorithm>
#include <cmath>
#include <fstream>

#include <gtest/gtest.h>

#include "pipeline/error.h"
#include "tests/pipeline/scratch_folder.h"

namespace geocage::topology {
namespace {

using geometry::Pose;

/// Points at the angles 2 pi i / n, closed by repeating the first.
template <class Curve>
Polyline closed_polyline(int n, Curve at) {
  Polyline points;
  for (int i = 0; i <= n; ++i) points.push_back(at(2 * M_PI * (i % n) / n));
  return points;
}

Polyline ring(int n, const Vec3& center = Vec3::Zero()) {
  return closed_polyline(n, [&](double t) -> Vec3 { return center + Vec3(std::cos(t), std::sin(t), 0); });
}

Polyline reversed(Polyline points) {
  std::reverse(points.begin(), points.end());
  return points;
}

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

TEST(WindingNumber, Turns) {
  const Vec3 center(0, 0, 3), normal = Vec3::UnitZ();  // heights don't count
  const auto twice = closed_polyline(14, [](double t) { return Vec3(std::cos(2 * t), std::sin(2 * t), t); });
  EXPECT_NEAR(winding_number(ring(7), center, normal), 1, 1e-14);
  EXPECT_NEAR(winding_number(ring(7), center, normal, Turning::is_unsigned), 1, 1e-14);
  EXPECT_NEAR(winding_number(twice, center, normal), 2, 1e-14);
  EXPECT_NEAR(winding_number(reversed(ring(7)), center, normal), -1, 1e-14);
  EXPECT_NEAR(winding_number(reversed(ring(7)), center, normal, Turning::is_unsigned), 1, 1e-14);
}

TEST(WindingNumber, CentreOutside) {
  const Vec3 center(2, 0, 0);
  EXPECT_NEAR(winding_number(ring(4096), center, Vec3::UnitZ()), 0, 1e-13);
  // There and back over the angle between the tangents, 2 asin(1/2): 4 asin(1/2) / (2 pi) = 1/3. The
  // polygon's silhouette misses the tangent points by at most half a side, second order in the angle.
  EXPECT_NEAR(winding_number(ring(4096), center, Vec3::UnitZ(), Turning::is_unsigned), 1.0 / 3, 1e-5);
}

class PolylineFile : public ::testing::Test {
 protected:
  Polyline read(const std::string& text) {
    std::ofstream(folder_ / "line.csv") << text;
    return read_polyline(folder_ / "line.csv");
  }
  /// Where the refusal points to, after the folder.
  std::string refused_at(const std::string& text) {
    try {
      read(text);
    } catch (const pipeline::UserError& error) {
      EXPECT_EQ(error.fault(), pipeline::Fault::input);
      return std::filesystem::path(error.where()).filename().string();
    }
    return "read";
  }
  tests::ScratchFolder folder_;
};

TEST_F(PolylineFile, ReadsNumbersBlankLinesAndCarriageReturns) {
  const auto points = read("0,0,0\r\n\n 1e-3, -2 ,3.5\n");
  ASSERT_EQ(points.size(), 2u);
  EXPECT_EQ(points[1], Vec3(1e-3, -2, 3.5));
}

TEST_F(PolylineFile, NamesTheLineThatIsWrong) {
  EXPECT_EQ(refused_at("0,0,0\n1,2\n3,4,5\n"), "line.csv:2");
  EXPECT_EQ(refused_at("x,y,z\n0,0,0\n1,1,1\n"), "line.csv:1");
  EXPECT_EQ(refused_at("0,0,0\n1 2 3\n"), "line.csv:2");
  EXPECT_EQ(refused_at("0,0,0\n1,2,3,4\n"), "line.csv:2");
  EXPECT_EQ(refused_at("0,0,0\n\n1,nan,3\n"), "line.csv:3");
  EXPECT_EQ(refused_at("0,0,0\n"), "line.csv");
  EXPECT_EQ(refused_at(""), "line.csv");
}

TEST_F(PolylineFile, MissingFile) {
  EXPECT_THROW(read_polyline(folder_ / "none.csv"), pipeline::UserError);
}

}  // namespace
}  // namespace geocage::topology
