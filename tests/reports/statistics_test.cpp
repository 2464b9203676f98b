#include "reports/statistics.h"

#include <cmath>

#include <gtest/gtest.h>

namespace geocage::reports {
namespace {

// Published tables give percent with one decimal: half a unit of the last digit, and a hair for exact halves.
constexpr double last_digit = 0.000501;

TEST(Wilson, AgreesWithPublishedTables) {
  struct Case {
    int hits, trials;
    double low, high;
  };
  for (const auto& [hits, trials, low, high] : {Case{75, 100, 0.657, 0.825},
                                                {150, 200, 0.686, 0.805},
                                                {750, 1000, 0.722, 0.776},
                                                {950, 1000, 0.935, 0.962}}) {
    const auto p = wilson(hits, trials);
    EXPECT_NEAR(p.low, low, last_digit) << trials;
    EXPECT_NEAR(p.high, high, last_digit) << trials;
    EXPECT_DOUBLE_EQ(p.share, double(hits) / trials);
  }
}

// The limits are where the score test just rejects: (p - p0)^2 = z^2 p0 (1 - p0) / n.
TEST(Wilson, LimitsSolveTheScoreEquation) {
  const double z = 1.959963984540054;
  for (int hits = 0; hits <= 8; ++hits) {
    const auto p = wilson(hits, 8);
    for (double p0 : {p.low, p.high})
      EXPECT_NEAR(std::pow(p.share - p0, 2), z * z * p0 * (1 - p0) / 8, 1e-15) << hits;
  }
}

TEST(Wilson, WithoutTrialsNothingIsKnown) {
  const auto p = wilson(0, 0);
  EXPECT_EQ(p.low, 0);
  EXPECT_EQ(p.high, 1);
}

// By hand: 2 / 2^5; 2 (1 + 12 + 66) / 2^12; an even split tells nothing.
TEST(McNemar, IsTheExactBinomialTest) {
  EXPECT_DOUBLE_EQ(mcnemar(0, 5), 0.0625);
  EXPECT_NEAR(mcnemar(10, 2), 2 * 79 / 4096.0, 1e-15);
  EXPECT_EQ(mcnemar(2, 10), mcnemar(10, 2));
  EXPECT_EQ(mcnemar(3, 3), 1);
  EXPECT_EQ(mcnemar(0, 0), 1);
}

}  // namespace
}  // namespace geocage::reports
