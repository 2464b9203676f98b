#include "reports/bootstrap.h"

#include <cmath>

#include <gtest/gtest.h>

namespace geocage::reports {
namespace {

TEST(Bootstrap, IntervalOfManyGroupsIsThatOfTheNormalLaw) {
  // 400 groups of one value each, half 0 and half 1: the mean of a draw has the deviation 0.5 / sqrt(400) =
  // 0.025, so 95 % lie within 0.049. Quantiles of 2000 draws scatter by about 2.7 / sqrt(2000) * 0.025 =
  // 0.0015; four of these.
  std::vector<std::vector<double>> groups;
  for (int i = 0; i < 400; ++i) groups.push_back({double(i % 2)});
  const auto mean = bootstrap_over_groups(groups);
  EXPECT_EQ(mean.mean, 0.5);
  EXPECT_NEAR(mean.low, 0.5 - 1.96 * 0.025, 0.006);
  EXPECT_NEAR(mean.high, 0.5 + 1.96 * 0.025, 0.006);
}

TEST(Bootstrap, AlikeWithinGroupsMeansAWiderInterval) {
  // ten values in each of 40 groups, all the same in a group: only 40 of the 400 values are independent
  std::vector<std::vector<double>> alike, mixed(40);
  for (int i = 0; i < 40; ++i) {
    alike.emplace_back(10, double(i % 2));
    for (int k = 0; k < 10; ++k) mixed[i].push_back(k % 2);
  }
  const auto wide = bootstrap_over_groups(alike), none = bootstrap_over_groups(mixed);
  EXPECT_GT(wide.high - wide.low, 0.2);  // 2 * 1.96 * 0.5 / sqrt(40) = 0.31
  EXPECT_EQ(none.high - none.low, 0.0);  // every group has the same mean
}

TEST(Bootstrap, FewerThanTwoGroupsHaveNoInterval) {
  EXPECT_EQ(bootstrap_over_groups({{}, {}}).mean, 0);
  EXPECT_TRUE(std::isnan(bootstrap_over_groups({}).high));
  const auto one = bootstrap_over_groups({{}, {0, 1, 1, 1}});
  EXPECT_EQ(one.mean, 0.75);
  EXPECT_TRUE(std::isnan(one.low) && std::isnan(one.high));
}

}  // namespace
}  // namespace geocage::reports
