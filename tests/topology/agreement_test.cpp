#include "topology/agreement.h"

#include <algorithm>
#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace geocage::topology {
namespace {

const double nan = std::nan("");

// Without ties Spearman's coefficient is 1 - 6 sum d^2 / (n (n^2 - 1)), d the difference of ranks.
TEST(RankCorrelation, IsTheFormulaOfDifferences) {
  // ranks 0 1 2 3 4 against 1 0 2 4 3: sum d^2 = 4, 1 - 24 / 120
  EXPECT_NEAR(rank_correlation({1, 2, 3, 4, 5}, {20, 10, 30, 500, 40}), 0.8, 1e-15);
  EXPECT_EQ(rank_correlation({1, 2, 3}, {3, 30, 300}), 1);
  EXPECT_EQ(rank_correlation({1, 2, 3}, {3, 2, -9}), -1);
}

// Ties by hand: ranks 0.5 0.5 2 against 0 1 2, about their mean 1: (-.5 -.5 1).(-1 0 1) / sqrt(1.5 * 2)
TEST(RankCorrelation, TiesShareTheirMeanRank) {
  EXPECT_NEAR(rank_correlation({7, 7, 8}, {1, 2, 3}), 1.5 / std::sqrt(3.0), 1e-15);
}

TEST(RankCorrelation, LeavesOutWhatIsNotFinite) {
  EXPECT_NEAR(rank_correlation({1, nan, 2, 3, 0}, {1, 5, 2, 3, nan}), 1, 1e-15);
  EXPECT_TRUE(std::isnan(rank_correlation({1, nan}, {nan, 1})));
  EXPECT_TRUE(std::isnan(rank_correlation({1, 1, 1}, {1, 2, 3})));
}

TEST(RankCorrelation, MonotoneMapsChangeNothing) {
  std::mt19937_64 random(3);
  std::vector<double> x(500), y(500), warped;
  for (double& v : x) v = static_cast<double>(random() % 1000);
  for (double& v : y) v = static_cast<double>(random() % 1000);
  for (double v : y) warped.push_back(std::exp(v / 100));
  EXPECT_EQ(rank_correlation(x, y), rank_correlation(x, warped));
  EXPECT_LT(std::abs(rank_correlation(x, y)), 4 / std::sqrt(500.0));  // independent: deviation 1 / sqrt n
}

TEST(TopSet, TakesTheShareAndCutsNoTie) {
  EXPECT_EQ(top_set({5, 1, 4, nan, 3, 2}, 0.4), (std::vector<int>{0, 2}));
  EXPECT_EQ(top_set({5, 1, 5, 5, 3, 2}, 0.3), (std::vector<int>{0, 2, 3}));
  EXPECT_TRUE(top_set({nan, nan}, 0.5).empty());
}

TEST(Overlap, IsCommonOverAll) {
  EXPECT_EQ(overlap({1, 2, 3}, {2, 3, 4, 5}), 0.4);
  EXPECT_EQ(overlap({}, {1}), 0);
  EXPECT_EQ(overlap({}, {}), 1);
}

}  // namespace
}  // namespace geocage::topology
