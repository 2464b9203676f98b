#include "motion/floating_hand.h"

#include <random>

#include <gtest/gtest.h>

#include "datasets/shapes.h"

namespace geocage::motion {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

class FloatingHandTest : public testing::Test {
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
  const FloatingHand floating_{hand_, goal()};
};

TEST_F(FloatingHandTest, StateAndPoseAreInverse) {
  std::mt19937_64 random(1);
  for (int i = 0; i < 50; ++i) {
    const VectorXd x = random_state(random);
    const VectorXd back = floating_.state(floating_.pose(x), floating_.joints(x));
    EXPECT_LT((back - x).lpNorm<Eigen::Infinity>(), 1e-12);
  }
  EXPECT_LT(floating_.state(goal(), hand_.open_rad).head<6>().norm(), 1e-15);
}

TEST_F(FloatingHandTest, BallsLieInTheirCapsules) {
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
TEST_F(FloatingHandTest, GradientRowsAreDerivatives) {
  std::mt19937_64 random(2);
  const double step = 1e-5;
  for (int i = 0; i < 20; ++i) {
    const VectorXd x = random_state(random);
    std::vector<Pose> X_HL, X_OL, unused;
    floating_.place_links(x, X_HL, X_OL);
    const auto& ball = floating_.balls()[static_cast<std::size_t>(i) % floating_.balls().size()];
    const Vec3 g(0.3, -0.5, 0.8);
    const auto row = floating_.gradient_row(x, X_HL, ball.link, X_OL[ball.link] * ball.p_L, g);
    for (int k = 0; k < x.size(); ++k) {
      const auto height = [&](double change) {
        VectorXd moved = x;
        moved[k] += change;
        std::vector<Pose> links;
        floating_.place_links(moved, unused, links);
        return g.dot(links[ball.link] * ball.p_L);
      };
      EXPECT_NEAR(row[k], (height(step) - height(-step)) / (2 * step), 1e-8) << k;
    }
  }
}

TEST_F(FloatingHandTest, ClearanceIsAHingeWithItsDerivative) {
  const auto field = geometry::build_distance_field(datasets::icosphere(0.04, 4), {40, 0.05, 1});
  const geometry::Plane table{Vec3::UnitZ(), -0.25};
  const double margin = 0.05, step = 1e-7;
  const Task task =
      clearance_task(floating_, field, table, constant_precision(1, margin), constant_precision(1, 1));
  VectorXd x = floating_.state(goal(), hand_.open_rad), error, up, down;
  MatrixXd J;
  task.evaluate(0, x, error, &J);
  ASSERT_GT(error.size(), 0);
  EXPECT_GT(error.minCoeff(), 0);
  EXPECT_EQ(J.rows(), error.size());
  for (int k = 0; k < x.size(); ++k) {
    VectorXd plus = x, minus = x;
    plus[k] += step;
    minus[k] -= step;
    task.evaluate(0, plus, up, nullptr);
    task.evaluate(0, minus, down, nullptr);
    ASSERT_EQ(up.size(), error.size());
    // The trilinear field has kinks at cell faces: one-sided slopes bound the derivative.
    const VectorXd slope = (up - down) / (2 * step), kink = ((up - error) - (error - down)).cwiseAbs() / step;
    for (int i = 0; i < error.size(); ++i) EXPECT_NEAR(J(i, k), slope[i], 1e-5 + kink[i]);
  }
}

}  // namespace
}  // namespace geocage::motion
