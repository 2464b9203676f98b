#include "motion/certificate.h"

#include <random>

#include <gtest/gtest.h>

#include "datasets/shapes.h"

namespace geocage::motion {
namespace {

using Eigen::VectorXd;

constexpr double radius_m = 0.04;

class CertificateTest : public testing::Test {
 protected:
  std::vector<double> tolerance(double m) const { return std::vector<double>(hand_.tree.links.size(), m); }
  VectorXd random_state(std::mt19937_64& random) const {
    std::uniform_real_distribution<> unit(-1, 1);
    VectorXd x(floating_.dim());
    for (auto& value : x) value = unit(random);
    for (int i = 0; i < hand_.tree.dofs(); ++i)
      x[6 + i] = std::clamp(x[6 + i], hand_.tree.lower_rad[i], hand_.tree.upper_rad[i]);
    x.head<3>() *= 1.2;
    return x;
  }
  /// Signed distance of the nearest capsule to the ball that the mesh's corners lie on, in closed form.
  double ball_clearance(const VectorXd& x) const {
    double least = 1;
    for (const auto& c : hands::placed_capsules(hand_, floating_.pose(x), floating_.joints(x))) {
      const Vec3 along = c.b - c.a;
      const double s = std::clamp(-c.a.dot(along) / std::max(along.squaredNorm(), 1e-12), 0.0, 1.0);
      least = std::min(least, (c.a + s * along).norm() - radius_m - c.radius_m);
    }
    return least;
  }
  double sampled(const VectorXd& from, const VectorXd& to, int samples) const {
    double least = 1;
    for (int k = 0; k <= samples; ++k)
      least = std::min(least, ball_clearance(from + double(k) / samples * (to - from)));
    return least;
  }

  const hands::Hand hand_ = hands::load_hand("schunk_sdh");
  const FloatingHand floating_{hand_, Pose(Eigen::Translation3d(0.0, 0.0, -0.2))};
  const geometry::TriangleMesh mesh_ = datasets::icosphere(radius_m, 4);
  const geometry::SignedDistanceField field_ = geometry::build_distance_field(mesh_, {40, 0.04, 2});
};

TEST_F(CertificateTest, TheFieldBoundIsBelowTheDistanceAndNotFarBelow) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<> place(-0.15, 0.15);
  double over = -1, slack = 0;
  int counted = 0;
  for (int i = 0; i < 2000; ++i) {
    const Vec3 p(place(random), place(random), place(random));
    const double bound = distance_at_least_m(field_, p);
    // The mesh lies within the ball of its corners: its distance is at least that of the ball, at most sag
    // more.
    const double sag = 5e-5, exact = p.norm() - radius_m;
    over = std::max(over, bound - exact - sag);
    if (exact < 0.005 || exact > 0.03) continue;
    slack += exact - bound;
    ++counted;
  }
  EXPECT_LE(over, 0);
  // E^2 / (2 d) with cells of 4 mm (2 mm near the surface): at most 0.75 x 4^2 / (2 x 10) = 0.6 mm.
  EXPECT_LT(slack / counted, 6e-4);
}

TEST_F(CertificateTest, NoPointTravelsFurtherThanTheBound) {
  std::mt19937_64 random(2);
  Prover prover(floating_, field_, std::nullopt);
  for (int i = 0; i < 300; ++i) {
    const VectorXd x = random_state(random), change = 0.3 * (random_state(random) - x);
    for (double part : {1.0, 0.6, -1.0}) {
      prover.look_at(x + part * change);
      const auto moved = prover.placed_O();
      prover.look_at(x);
      for (std::size_t c = 0; c < moved.size(); ++c) {
        const auto& here = prover.placed_O()[c];
        const double travel = std::max((moved[c].a - here.a).norm(), (moved[c].b - here.b).norm());
        EXPECT_LE(travel, prover.travel_m(static_cast<int>(c), change) + 1e-12);
      }
    }
  }
}

// A mesh point is at most 5e-5 (its sag) inside the ball: a truly free path is at least -tolerance - sag from
// it.
TEST_F(CertificateTest, NeverAcceptsWhatDenseSamplesRefuse) {
  std::mt19937_64 random(3);
  Prover prover(floating_, field_, std::nullopt);
  int free = 0, refused = 0, wrongly_refused = 0, undecided = 0;
  for (int i = 0; i < 1500; ++i) {
    const VectorXd from = random_state(random), to = from + 0.4 * (random_state(random) - from);
    const auto answer = prover.certify({from, to}, tolerance(5e-4));
    const double least = sampled(from, to, 40);
    undecided += answer.outcome == Proof::undecided;
    if (answer.outcome == Proof::free) {
      ++free;
      EXPECT_GE(least, -5e-4 - 5e-5);
      EXPECT_LE(answer.clearance_m, least + 5e-5);
      // Resolution 1 mm; the field's bound is up to 1.7 mm low where cells of 4 mm meet thin capsules. Far
      // off, beyond the grid's corners, it is lower.
      if (least < 0.01) {
        EXPECT_GE(answer.clearance_m, least - 0.003);
      }
    } else {
      ++refused;
      wrongly_refused += least > 0.001;
    }
  }
  EXPECT_GT(free, 300);
  EXPECT_GT(refused, 300);
  EXPECT_LE(wrongly_refused, refused / 100);
  EXPECT_LE(undecided, refused / 100);
}

TEST_F(CertificateTest, ATunnelBetweenTwoFreeEndsIsSeen) {
  VectorXd from = floating_.state(Pose(Eigen::Translation3d(0.6, 0, 0)), hand_.open_rad), to = from;
  to[0] = -from[0];
  Prover prover(floating_, field_, std::nullopt);
  EXPECT_TRUE(prover.posture_free(from, 0.01));
  EXPECT_TRUE(prover.posture_free(to, 0.01));
  const auto answer = prover.certify({from, to}, tolerance(5e-4));
  EXPECT_EQ(answer.outcome, Proof::collides);
  EXPECT_GT(answer.at, 0.3);
  EXPECT_LT(answer.at, 0.7);
}

TEST_F(CertificateTest, TheSupportCounts) {
  const VectorXd x = floating_.state(Pose(Eigen::Translation3d(0, 0, 0.3)), hand_.open_rad);
  VectorXd down = x;
  down[2] -= 1;
  Prover alone(floating_, field_, std::nullopt);
  Prover table(floating_, field_, geometry::Plane{Vec3::UnitZ(), 0.25});
  EXPECT_EQ(alone.certify({x, down}, tolerance(0)).outcome, Proof::free);
  EXPECT_EQ(table.certify({x, down}, tolerance(0)).outcome, Proof::collides);
}

TEST_F(CertificateTest, LinksWithLeaveMayTouch) {
  const VectorXd x = floating_.state(Pose(Eigen::Translation3d(0, 0, -0.1)), hand_.open_rad);
  Prover prover(floating_, field_, std::nullopt);
  const auto strict = prover.certify({x, x}, tolerance(0));
  ASSERT_EQ(strict.outcome, Proof::collides);
  EXPECT_EQ(prover.certify({x, x}, tolerance(1)).outcome, Proof::free);
}

}  // namespace
}  // namespace geocage::motion
