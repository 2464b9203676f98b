#include "motion/shortcuts.h"

#include <gtest/gtest.h>

#include "datasets/shapes.h"

namespace geocage::motion {
namespace {

using Eigen::VectorXd;

/// A floating hand that comes down at a ball of 40 mm.
class ShortcutsTest : public testing::Test {
 protected:
  VectorXd at(double x_m, double z_m) const {
    return floating_.state(Pose(Eigen::Translation3d(x_m, 0, z_m)), hand_.open_rad);
  }
  /// By way of three corners, `steps` steps.
  static Path way(const VectorXd& a, const VectorXd& b, const VectorXd& c, int steps) {
    return respaced({a, b, c}, steps);
  }
  std::vector<double> tolerance(double m) const { return std::vector<double>(hand_.tree.links.size(), m); }

  const hands::Hand hand_ = hands::load_hand("schunk_sdh");
  const Mover floating_ = Mover::floating(hand_, Pose(Eigen::Translation3d(0, 0, -0.3)));
  const geometry::SignedDistanceField field_ =
      geometry::build_distance_field(datasets::icosphere(0.04, 4), {40, 0.04, 2});
  Prover prover_{floating_, {{{&field_}}, {}}};
  Shortcuts shortcuts_{prover_, {tolerance(-0.001), tolerance(0.003)}};
};

TEST_F(ShortcutsTest, InTheOpenTheWayIsStraight) {
  const Path bent = way(at(-0.2, -0.5), at(0, -0.7), at(0.2, -0.5), 40);
  Path path = bent;
  std::size_t free = path.size();
  shortcuts_.shorten(path, free);
  EXPECT_NEAR(length_of(path), (bent.back() - bent.front()).norm(), 1e-12);
  EXPECT_EQ(path.size(), bent.size());
  EXPECT_EQ(free, bent.size());
  EXPECT_EQ(path.front(), bent.front());
  EXPECT_EQ(path.back(), bent.back());
}

TEST_F(ShortcutsTest, PastTheBallItIsShorterAndStillProven) {
  // From one side of the ball to the other, far below it; two joints tremble on the way.
  Path bent = way(at(-0.3, 0), at(0, -0.6), at(0.3, 0), 40);
  for (std::size_t t = 1; t < 40; t += 2) bent[t].tail<2>().array() += 0.1;
  ASSERT_TRUE(prover_.frees(bent, tolerance(-0.001)));
  Path path = bent;
  std::size_t free = path.size();
  shortcuts_.shorten(path, free);
  EXPECT_LT(length_of(path), 0.9 * length_of(bent));
  EXPECT_GT(length_of(path), (bent.back() - bent.front()).norm() + 0.1);  // the ball is between
  EXPECT_TRUE(prover_.frees(path, tolerance(-0.001)));
  Path again = bent;
  std::size_t free_again = again.size();
  shortcuts_.shorten(again, free_again);
  EXPECT_EQ(path, again);
}

TEST_F(ShortcutsTest, TheLastPieceEndsTheFreePartAtItsFirstContact) {
  // Down onto the ball until the palm's fingers would be 2 mm deep: free is what keeps a millimetre.
  const VectorXd far = at(0, -0.5);
  double low = -0.5, high = -0.1;  // deepest posture that the closing's tolerance allows
  for (int k = 0; k < 40; ++k) {
    const double middle = (low + high) / 2;
    (prover_.posture_free(at(0, middle), tolerance(0.002)) ? low : high) = middle;
  }
  Path path = respaced({far, at(0, low)}, 40);
  std::size_t free = 20;
  shortcuts_.shorten(path, free);
  EXPECT_GT(free, 20u);
  ASSERT_LT(free, path.size());
  EXPECT_TRUE(
      prover_.frees(Path(path.begin(), path.begin() + static_cast<std::ptrdiff_t>(free)), tolerance(-0.001)));
  EXPECT_FALSE(prover_.posture_free(path[free], tolerance(-0.001)));
}

TEST_F(ShortcutsTest, WhatIsProvenDoesNotTouch) {
  for (int k = 0; k <= 100; ++k) {
    const VectorXd x = at(0.1 - 0.002 * k, -0.3 + 0.003 * k);
    if (prover_.posture_free(x, tolerance(0))) EXPECT_FALSE(prover_.touches(x, tolerance(0))) << k;
  }
  EXPECT_TRUE(prover_.touches(at(0, 0), tolerance(0)));
}

}  // namespace
}  // namespace geocage::motion
