#include "stages/import/sight.h"

#include <numeric>

#include <gtest/gtest.h>

#include "stages/import/part_graph.h"

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

// From 5.6 cm left to 5.6 cm right at 0.8 m, behind a wall at 0.6 m that reaches to 2.1 cm on either side:
// 2.8 cm at 0.8 m. Half of the way, but for cells of 2 mm at both edges and 20 steps.
TEST(Sight, TellsHowMuchOfAWayIsHidden) {
  const auto behind = wall(0.8, -0.06, 0.06);
  const Sight sight(together(behind, wall(0.6, -0.021, 0.021)));
  EXPECT_NEAR(sight.hidden_along({0.8, -0.056, 0}, {0.8, 0.056, 0}, 0.008), 0.5, 0.1);
  EXPECT_EQ(Sight(behind).hidden_along({0.8, -0.056, 0}, {0.8, 0.056, 0}, 0.008), 0);
}

/// Pairs that are asked of two walls that far apart, with or without a wall before the gap.
std::size_t pairs_across(double gap_m, bool hidden) {
  geometry::PointCloud cloud;
  cloud.sensor_origins = {Vec3::Zero()};
  cloud.points = together(wall(0.8, -gap_m / 2 - 0.03, -gap_m / 2), wall(0.8, gap_m / 2, gap_m / 2 + 0.03));
  std::vector<int> both(cloud.size());
  std::iota(both.begin(), both.end(), 0);
  if (hidden) cloud.points = together(cloud.points, wall(0.6, -0.4 * gap_m, 0.4 * gap_m));
  const Sight sight = sight_of(cloud);
  const PartGraph graph(cloud, sight, both, {Vec3::UnitZ(), -0.04}, {0.015, 15, 600, 300, 0.5});
  EXPECT_EQ(graph.parts().size(), 2U);
  return graph.pairs().size();
}

// Farther apart than most_gap_m only where something hides what is between, and not beyond most_hidden_gap_m.
TEST(PartGraph, AsksAcrossWhatIsHidden) {
  EXPECT_EQ(pairs_across(0.02, false), 1U);
  EXPECT_EQ(pairs_across(0.06, false), 0U);
  EXPECT_EQ(pairs_across(0.06, true), 1U);
  EXPECT_EQ(pairs_across(0.12, true), 0U);
}

}  // namespace
}  // namespace geocage::stages
