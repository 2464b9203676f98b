#include "motion/timing.h"

#include <cmath>

#include <gtest/gtest.h>

namespace geocage::motion {
namespace {

using Eigen::VectorXd;
using Path = std::vector<VectorXd>;

Path line(int steps) {
  Path path;
  for (int t = 0; t <= steps; ++t) path.push_back(VectorXd::Constant(1, double(t) / steps));
  return path;
}

// By hand: moves of 1/10; speed 0.5 wants 0.2 s, acceleration 2 from rest wants sqrt(0.1 / 2) = 0.2236 s.
TEST(Timing, TheShortestStepByHand) {
  const MotionLimits slow{VectorXd::Constant(1, 0.5), VectorXd::Constant(1, 100)};
  EXPECT_NEAR(shortest_step_s(line(10), slow), 0.2, 1e-12);
  const MotionLimits weak{VectorXd::Constant(1, 10), VectorXd::Constant(1, 2)};
  EXPECT_NEAR(shortest_step_s(line(10), weak), std::sqrt(0.1 / 2), 1e-12);
  const MotionLimits none{VectorXd::Zero(1), VectorXd::Constant(1, 2)};
  EXPECT_NEAR(shortest_step_s(line(10), none), std::sqrt(0.1 / 2), 1e-12);
}

// Even steps need 10 x 0.2236 s for what a bang-bang motion does in 2 sqrt(1 / 2) = 1.41 s. Waypoints spread
// in time come near to that; never below.
TEST(Timing, EvenedWaypointsTakeLessTime) {
  const MotionLimits weak{VectorXd::Constant(1, 10), VectorXd::Constant(1, 2)};
  const Path path = line(40);
  const auto even = evened_in_time(path, weak);
  ASSERT_EQ(even.path.size(), path.size());
  EXPECT_EQ(even.path.front(), path.front());
  EXPECT_EQ(even.path.back(), path.back());
  for (std::size_t k = 1; k < even.place.size(); ++k) EXPECT_GE(even.place[k], even.place[k - 1]);
  const double before = 40 * shortest_step_s(path, weak), after = 40 * shortest_step_s(even.path, weak);
  EXPECT_LT(after, 0.6 * before);
  EXPECT_GE(after, 2 * std::sqrt(0.5));
}

// x = t^2 in steps of h: second differences are 2 h^2, so |acceleration|^2 h adds up to 4 T inside; the ends
// stop.
TEST(Timing, EfficiencyOfAParabola) {
  const double h = 0.01;
  Path path;
  for (int t = 0; t <= 100; ++t) path.push_back(VectorXd::Constant(1, std::pow(t * h, 2)));
  const auto e = efficiency_of(path, h);
  EXPECT_DOUBLE_EQ(e.duration_s, 1);
  EXPECT_NEAR(e.length, 1, 1e-12);
  // First step from rest: h^2 / h^2 = 1; then 99 times 2; then a stop from (2 - h) / h.
  EXPECT_NEAR(e.effort, h * (1 + 99 * 4 + std::pow((2 - h) / h, 2)), 1e-6);
}

TEST(Timing, ASmootherPathTakesLessEffort) {
  Path corner, bend;
  for (int t = 0; t <= 20; ++t) {
    const double s = t / 20.0;
    corner.push_back(s < 0.5 ? Eigen::Vector2d(2 * s, 0) : Eigen::Vector2d(1, 2 * s - 1));
    bend.push_back(Eigen::Vector2d(std::sin(s * M_PI / 2), 1 - std::cos(s * M_PI / 2)));
  }
  EXPECT_LT(efficiency_of(bend, 0.1).effort, efficiency_of(corner, 0.1).effort);
  EXPECT_LT(efficiency_of(bend, 0.1).smoothness, efficiency_of(corner, 0.1).smoothness);
}

}  // namespace
}  // namespace geocage::motion
