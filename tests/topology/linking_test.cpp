#include "topology/linking.h"

#include <gtest/gtest.h>

#include "tests/topology/curves.h"

namespace geocage::topology {
namespace {

/// Point i of n at the angle 2 pi i / n; not repeated.
template <class Curve>
Polyline loop(int n, Curve at) {
  Polyline points = closed_polyline(n, at);
  points.pop_back();
  return points;
}
Polyline circle(int n) {
  return loop(n, [](double t) { return Vec3(std::cos(t), std::sin(t), 0); });
}
void expect_linked(const Polyline& first, const Polyline& second, int value) {
  const auto link = linking_number(first, second);
  EXPECT_EQ(link.value, value);
  EXPECT_LT(link.residual, 1e-12);  // some thousand pairs of 1e-15
}

TEST(LinkingNumber, HopfLinkHoweverCoarse) {
  for (int n : {3, 4, 8, 32}) {
    const auto second = loop(n, [](double t) { return Vec3(1 + std::cos(t), 0, std::sin(t)); });
    expect_linked(circle(n), second, -1);
    expect_linked(second, circle(n), -1);
    expect_linked(circle(n), reversed(second), 1);
  }
}

TEST(LinkingNumber, AMirrorTurnsItsSign) {
  const auto mirrored = [](Polyline points) {
    for (Vec3& p : points) p.x() = -p.x();
    return points;
  };
  const auto second = loop(8, [](double t) { return Vec3(1 + std::cos(t), 0, std::sin(t)); });
  expect_linked(mirrored(circle(8)), mirrored(second), 1);  // the link itself is -1
}

TEST(LinkingNumber, SquaresAndCirclesApart) {
  expect_linked({{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}},
                {{0, 0, -1}, {2, 0, -1}, {2, 0, 1}, {0, 0, 1}}, -1);
  expect_linked(circle(32), loop(32, [](double t) { return Vec3(5 + std::cos(t), 0, std::sin(t)); }), 0);
}

// A curve that runs p times round the tube while it runs once along a circle is linked p times with it.
TEST(LinkingNumber, HelicesOnATorus) {
  for (int p : {-3, -1, 0, 2, 5}) {
    const auto helix = loop(200, [&](double t) {
      const double r = 1 + 0.3 * std::cos(p * t);
      return Vec3(r * std::cos(t), r * std::sin(t), -0.3 * std::sin(p * t));
    });
    expect_linked(circle(100), helix, p);
  }
}

TEST(LinkingNumber, RandomClosedChainsAreWhole) {
  std::mt19937_64 random(9);
  for (int i = 0; i < 200; ++i) {
    const auto first = random_chain(random, 12), second = random_chain(random, 9);
    EXPECT_LT(linking_number(first, second).residual, 1e-11);
  }
}

TEST(LinkingNumber, CurvesThatTouchLeaveAResidual) {
  // Two squares whose sides share a corner point that only one of them has as a vertex: half of what is seen
  // at a crossing is missing.
  const auto link =
      linking_number({{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}}, {{1, 0, 0}, {2, 0, -1}, {0, 0, -1}});
  EXPECT_GT(link.residual, 0.01);
}

}  // namespace
}  // namespace geocage::topology
