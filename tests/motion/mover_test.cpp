#include "motion/mover.h"

#include <random>

#include <gtest/gtest.h>

namespace geocage::motion {
namespace {

using Eigen::VectorXd;

class MoverTest : public testing::Test {
 protected:
  Pose goal() const {
    return Pose(Eigen::Translation3d(0.02, -0.01, -0.17) *
                Eigen::AngleAxisd(0.4, Vec3(1, 2, -1).normalized()));
  }
  VectorXd random_state(std::mt19937_64& random) const {
    std::uniform_real_distribution<> unit(-1, 1);
    VectorXd x(hand_.tree.dofs() + 6);
    for (auto& value : x) value = 0.6 * unit(random);
    return x;
  }
  const hands::Hand hand_ = hands::load_hand("schunk_sdh");
  const Mover floating_ = Mover::floating(hand_, goal());
};

TEST_F(MoverTest, StateAndPoseAreInverse) {
  std::mt19937_64 random(1);
  for (int i = 0; i < 50; ++i) {
    const VectorXd x = random_state(random);
    const VectorXd back = floating_.state(floating_.pose(x), floating_.joints(x));
    EXPECT_LT((back - x).lpNorm<Eigen::Infinity>(), 1e-12);
  }
  EXPECT_LT(floating_.state(goal(), hand_.open_rad).head<6>().norm(), 1e-15);
}

TEST_F(MoverTest, BallsLieInTheirCapsules) {
  EXPECT_GE(floating_.balls().size(), hand_.capsules.size());
  for (const auto& ball : floating_.balls()) {
    double least = 1;
    for (const auto& c : hand_.capsules) {
      if (c.link != ball.link || c.radius_m != ball.radius_m) continue;
      const Vec3 along = c.b_L - c.a_L;
      const double t =
          std::clamp((ball.p_L - c.a_L).dot(along) / std::max(along.squaredNorm(), 1e-12), 0.0, 1.0);
      least = std::min(least, (c.a_L + t * along - ball.p_L).norm());
    }
    EXPECT_LT(least, 1e-12);
  }
}

// Central differences: error about step^2 x third derivative (1e-10) plus rounding eps / step (1e-11).
TEST_F(MoverTest, GradientsAreDerivatives) {
  std::mt19937_64 random(2);
  const double step = 1e-5;
  Mover::Placed placed, moved;
  for (int i = 0; i < 20; ++i) {
    const VectorXd x = random_state(random);
    floating_.place(x, placed);
    const auto& ball = floating_.balls()[static_cast<std::size_t>(i) % floating_.balls().size()];
    const Vec3 g(0.3, -0.5, 0.8);
    VectorXd row = VectorXd::Zero(x.size());
    floating_.add_gradient(placed, ball.link, placed.X_OL[ball.link] * ball.p_L, g, row);
    for (int k = 0; k < x.size(); ++k) {
      const auto height = [&](double change) {
        VectorXd at = x;
        at[k] += change;
        floating_.place(at, moved);
        return g.dot(moved.X_OL[ball.link] * ball.p_L);
      };
      EXPECT_NEAR(row[k], (height(step) - height(-step)) / (2 * step), 1e-8) << k;
    }
  }
}

}  // namespace
}  // namespace geocage::motion
