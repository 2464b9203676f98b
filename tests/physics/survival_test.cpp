#include "physics/survival.h"

#include <cmath>

#include <gtest/gtest.h>

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

}  // namespace
}  // namespace geocage::physics
