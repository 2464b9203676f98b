#include "stages/import/sight.h"

#include <gtest/gtest.h>

namespace geocage::stages {
namespace {

using geometry::Vec3;

/// Upright and square to the x axis, every 1.5 mm from `low` to `high` along y.
std::vector<Vec3> wall(double x, double low, double high) {
  std::vector<Vec3> points;
  for (double y = low; y <= high; y += 0.0015)
    for (double z = -0.03; z <= 0.03; z += 0.0015) points.emplace_back(x, y, z);
  return points;
}

std::vector<Vec3> together(std::vector<Vec3> one, const std::vector<Vec3>& other) {
  one.insert(one.end(), other.begin(), other.end());
  return one;
}

// Middles between walls from 3 to 6 cm on either side lie within 1.5 cm of the axis. What stands before them
// hides them all; where it is one of the two, or stands behind them, none.
TEST(Sight, TellsWhatASpaceIsHiddenBy) {
  const auto left = wall(0.8, -0.06, -0.03), right = wall(0.8, 0.03, 0.06);
  const auto hidden = [&](double x, bool counts_as_right) {
    const auto before = wall(x, -0.021, 0.021);
    const Sight sight(together(together(left, right), before));
    return sight.hidden_between(left, right, sight.front_of(left),
                                sight.front_of(counts_as_right ? together(right, before) : right), 0.008);
  };
  EXPECT_EQ(hidden(0.6, false), 1);
  EXPECT_EQ(hidden(0.6, true), 0);
  EXPECT_EQ(hidden(0.85, false), 0);
}

}  // namespace
}  // namespace geocage::stages
