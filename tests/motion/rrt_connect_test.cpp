#include "motion/rrt_connect.h"

#include <gtest/gtest.h>

namespace geocage::motion {
namespace {

using Eigen::Vector2d;
using Eigen::VectorXd;

/// A wall at x = 0 with one gap at y in [1.5, 2].
bool beside_the_wall(const VectorXd& x) {
  return std::abs(x[0]) > 0.1 || (x[1] > 1.5 && x[1] < 2);
}
const Vector2d start(-1, -1), goal(1, -1), lower(-2, -2), upper(2, 2);

TEST(RrtConnect, GoesRoundAWallAndAnswersTheSameTwice) {
  const auto first = rrt_connect(start, goal, lower, upper, beside_the_wall, {});
  ASSERT_EQ(first.outcome, ConnectOutcome::found);
  EXPECT_EQ(first.path.front(), start);
  EXPECT_EQ(first.path.back(), goal);
  double length = 0;
  bool through_the_gap = false;
  for (std::size_t i = 0; i + 1 < first.path.size(); ++i) {
    length += (first.path[i + 1] - first.path[i]).norm();
    for (int k = 0; k <= 20; ++k) {
      const VectorXd x = first.path[i] + k / 20.0 * (first.path[i + 1] - first.path[i]);
      through_the_gap |= std::abs(x[0]) < 0.1 && x[1] > 1.4;
    }
  }
  EXPECT_TRUE(through_the_gap);
  EXPECT_GE(length,
            2 * std::hypot(0.9, 2.5) + 0.2 - 0.1);  // the shortest way, less half a sample at each corner
  rrt_connect(start, goal, lower, upper, beside_the_wall, {.seed = 2});  // other calls don't matter
  const auto second = rrt_connect(start, goal, lower, upper, beside_the_wall, {});
  EXPECT_EQ(first.path, second.path);
}

TEST(RrtConnect, SaysWhyThereIsNoPath) {
  const auto wall = [](const VectorXd& x) { return std::abs(x[0]) > 0.1; };
  const auto nowhere = [](const VectorXd& x) { return x[0] < 0.9; };
  EXPECT_EQ(rrt_connect(start, goal, lower, upper, wall, {.iterations = 200}).outcome,
            ConnectOutcome::gave_up);
  EXPECT_EQ(rrt_connect(start, goal, lower, upper, nowhere, {}).outcome, ConnectOutcome::goal_blocked);
  EXPECT_EQ(rrt_connect(goal, start, lower, upper, nowhere, {}).outcome, ConnectOutcome::start_blocked);
}

}  // namespace
}  // namespace geocage::motion
