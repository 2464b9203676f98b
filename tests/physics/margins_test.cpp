#include "physics/margins.h"

#include <cmath>

#include <gtest/gtest.h>

namespace geocage::physics {
namespace {

TEST(Margin, is_the_hardest_level_that_holds) {
  int asked = 0;
  const Margin margin = hardest(0, 1, 6, [&](double level) { return ++asked, level <= 0.3; });
  ASSERT_TRUE(margin.level);
  EXPECT_LE(*margin.level, 0.3);
  EXPECT_GT(*margin.level, 0.3 - 1.0 / 64);  // six halvings of 1
  EXPECT_EQ(asked, 8);                       // and both ends
  // Friction: the easy end is the larger one.
  const Margin friction = hardest(1, 0, 6, [](double mu) { return mu >= 0.3; });
  EXPECT_GE(*friction.level, 0.3);
  EXPECT_LT(*friction.level, 0.3 + 1.0 / 64);
  EXPECT_FALSE(hardest(0, 1, 6, [](double) { return false; }).level);
  EXPECT_EQ(hardest(0, 1, 6, [](double) { return true; }).level, 1);
}

// Displacements are about the palm: its centre moves by the shift alone, and the hand turns by the turn.
TEST(PoseDraws, move_the_palm_by_the_shift_and_turn_about_it) {
  hands::Hand hand;
  hand.palm_H = geometry::Vec3(0.01, -0.02, 0.1);
  geometry::Pose X_OH = geometry::Pose::Identity();
  X_OH.rotate(Eigen::AngleAxisd(0.7, geometry::Vec3(1, 2, 3).normalized()));
  X_OH.translation() = geometry::Vec3(0.3, 0.1, -0.2);
  for (const PoseDraw& draw : pose_draws(20, 4)) {
    EXPECT_LE(draw.shift.cwiseAbs().maxCoeff(), 1);
    EXPECT_LE(std::abs(draw.turn), 1);
    const geometry::Pose moved = displaced(hand, X_OH, draw, 0.005, 0.1);
    EXPECT_NEAR((moved * hand.palm_H - X_OH * hand.palm_H).norm(), 0.005 * draw.shift.norm(), 1e-12);
    const Eigen::Matrix3d R = X_OH.linear().transpose() * moved.linear();
    EXPECT_NEAR(Eigen::AngleAxisd(R).angle(), 0.1 * std::abs(draw.turn), 1e-9);
  }
  EXPECT_EQ(pose_draws(3, 1)[2].shift, pose_draws(5, 1)[2].shift);  // paired, whatever their number
  EXPECT_NE(pose_draws(3, 1)[2].shift, pose_draws(3, 2)[2].shift);
}

}  // namespace
}  // namespace geocage::physics
