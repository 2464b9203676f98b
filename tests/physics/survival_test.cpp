#include "physics/survival.h"

#include <cmath>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "geometry/noise.h"

namespace geocage::physics {
namespace {

// By hand: of 4 one leaves at 1 s; one is lost from sight at 2 s; of the 2 left one leaves at 3 s.
TEST(Survival, equals_the_product_done_by_hand) {
  const auto curve = survival({{3, true}, {1, true}, {2, false}, {5, false}});
  ASSERT_EQ(curve.size(), 3u);
  EXPECT_DOUBLE_EQ(curve[1].share, 0.75);
  EXPECT_DOUBLE_EQ(curve[2].share, 0.375);
  EXPECT_DOUBLE_EQ(share_at(curve, 2.9), 0.75);
  EXPECT_DOUBLE_EQ(mean_held_s(curve, 5), 1 + 2 * 0.75 + 2 * 0.375);
}

TEST(Survival, without_censoring_is_the_share_still_there) {
  geometry::RandomStream random(1, 0);
  std::vector<Life> lives(1000);
  for (Life& life : lives) life = {-std::log(random.uniform()), true};
  const auto curve = survival(lives);
  for (const double time : {0.2, 1.0, 2.5}) {
    double later = 0;
    for (const Life& life : lives) later += life.time_s > time;
    EXPECT_NEAR(share_at(curve, time), later / 1000, 1e-12);
  }
}

// Exponential lives of rate 1 watched for an exponential time of rate 1: S(t) = exp(-t) all the same. At t =
// 1, 4000 lives: the estimate's deviation is at most sqrt(S^2 (e^2 - 1) / 2 / n) = 0.0104 (Greenwood); 4 of
// them.
TEST(Survival, is_not_fooled_by_those_lost_from_sight) {
  geometry::RandomStream random(2, 0);
  std::vector<Life> lives(4000);
  for (Life& life : lives) {
    const double leaves = -std::log(random.uniform()), watched = -std::log(random.uniform());
    life = {std::min(leaves, watched), leaves <= watched};
  }
  EXPECT_NEAR(share_at(survival(lives), 1), std::exp(-1), 0.042);
}

// S falls from 0.9 at 1 weight to 0.1 at 2: half is left midway, on the straight line between them.
TEST(HalfAmplitude, is_where_the_line_between_two_amplitudes_crosses_one_half) {
  const auto half = half_amplitude({{5, 0, 10}, {1, 0.9, 10}, {0.5, 1, 10}, {2, 0.1, 10}});
  ASSERT_TRUE(half);
  EXPECT_EQ(half->is, HalfAmplitude::Is::at);
  EXPECT_NEAR(half->amplitude, 1.5, 1e-12);
  EXPECT_EQ(half->text(), "1.5");
  // S(a) = exp(-a ln 2 / 3) has a_50 = 3. Between 2 and 4 the chord lies above the curve by at most
  // (b - a)^2 / 8 max S'' = (ln 2 / 3)^2 S(2) / 2 = 0.017, which the chord's slope of 0.116 makes 0.15.
  std::vector<AmplitudeShare> shares;
  for (const double a : {1.0, 2.0, 4.0, 8.0}) shares.push_back({a, std::exp2(-a / 3), 100});
  EXPECT_NEAR(half_amplitude(shares)->amplitude, 3, 0.15);
  EXPECT_EQ(half_amplitude({{1, 0.5, 4}, {2, 0.5, 4}})->amplitude, 1);
}

TEST(HalfAmplitude, beyond_what_was_tested_is_no_number) {
  const auto below = half_amplitude({{0.5, 0.25, 4}, {1, 0, 4}}),
             above = half_amplitude({{5, 1, 4}, {1, 1, 4}});
  EXPECT_EQ(below->is, HalfAmplitude::Is::below);
  EXPECT_EQ(below->text(), "below 0.5");
  EXPECT_EQ(above->is, HalfAmplitude::Is::above);
  EXPECT_EQ(above->text(), "above 5");
  EXPECT_FALSE(half_amplitude({}));
  for (const auto& half : {below, above, half_amplitude({{1, 1, 4}, {2, 0, 4}}), half_amplitude({})}) {
    const auto read = half_amplitude_from(to_json(half));
    ASSERT_EQ(read.has_value(), half.has_value());
    EXPECT_EQ(read ? read->text() : "", half ? half->text() : "");
  }
}

// 0.2 at 1 weight and 0.8 at 2 are chance: pooled, with three times the trials at 2, both are 0.65, and half
// is reached between 2 and 4, where 0 is held: 2 + 2 (0.65 - 0.5) / 0.65.
TEST(HalfAmplitude, pools_shares_that_rise) {
  const auto half = half_amplitude({{1, 0.2, 10}, {2, 0.8, 30}, {4, 0, 10}});
  EXPECT_NEAR(half->amplitude, 2 + 2 * 0.15 / 0.65, 1e-12);
}

}  // namespace
}  // namespace geocage::physics
