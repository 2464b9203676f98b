#include "motion/certificate.h"

#include <cstdlib>
#include <random>

#include <gtest/gtest.h>

#include "datasets/shapes.h"
#include "hands/arm.h"
#include "hands/closing.h"
#include "motion/tasks/self_clearance.h"

namespace geocage::motion {
namespace {

using Eigen::VectorXd;

constexpr double radius_m = 0.04;

/// As many as GEOCAGE_CERTIFICATE_TRIALS says; `few` in the suite.
int trials(int few) {
  const char* wanted = std::getenv("GEOCAGE_CERTIFICATE_TRIALS");
  return wanted ? std::max(1, std::atoi(wanted)) : few;
}

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
  const Mover floating_ = Mover::floating(hand_, Pose(Eigen::Translation3d(0.0, 0.0, -0.2)));
  const geometry::TriangleMesh mesh_ = datasets::icosphere(radius_m, 4);
  const geometry::SignedDistanceField field_ = geometry::build_distance_field(mesh_, {40, 0.04, 2});
};

TEST_F(CertificateTest, TheFieldBoundIsBelowTheDistanceAndNotFarBelow) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<> place(-0.15, 0.15);
  double over = -1, slack = 0;
  int counted = 0;
  const DistanceBound known(field_);
  // The ball touches its own box only, and nodes are 4 mm apart: a node's distance is at most 0.1 mm more
  // than the face's least, and the bound takes 0.1 mm off that, of 40 mm of padding. The mesh lies within the
  // ball by a sag of 0.05 mm.
  for (int i = 0; i < 3; ++i) {
    EXPECT_LE(known.low_O()[i], -radius_m + 5e-5);
    EXPECT_GE(known.low_O()[i], -radius_m - 2.5e-4);
    EXPECT_GE(known.high_O()[i], radius_m - 5e-5);
    EXPECT_LE(known.high_O()[i], radius_m + 2.5e-4);
  }
  for (int i = 0; i < 2000; ++i) {
    const Vec3 p(place(random), place(random), place(random));
    const double bound = known.at_least_m(p);
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
  Prover prover(floating_, {{{&field_}}, {}});
  for (int i = 0; i < 300; ++i) {
    const VectorXd x = random_state(random), change = 0.3 * (random_state(random) - x);
    for (double part : {1.0, 0.6, -1.0}) {
      prover.look_at(x + part * change);
      const auto moved = prover.placed_O();
      prover.look_at(x);
      for (std::size_t c = 0; c < moved.size(); ++c) {
        const auto& here = prover.placed_O()[c];
        const double travel = std::max((moved[c].a - here.a).norm(), (moved[c].b - here.b).norm());
        const double bound = prover.near_travel_m(static_cast<int>(c), change);
        EXPECT_LE(travel, bound + 1e-12);
        EXPECT_LE(bound, prover.travel_m(static_cast<int>(c), change) + 1e-12);
      }
    }
  }
}

// A mesh point is at most 5e-5 (its sag) inside the ball: a truly free path is at least -tolerance - sag from
// it.
TEST_F(CertificateTest, NeverAcceptsWhatDenseSamplesRefuse) {
  std::mt19937_64 random(3);
  Prover prover(floating_, {{{&field_}}, {}});
  int free = 0, refused = 0, wrongly_refused = 0, undecided = 0;
  for (int i = 0; i < trials(1500); ++i) {
    const VectorXd from = random_state(random), to = from + 0.4 * (random_state(random) - from);
    const auto answer = prover.certify({from, to}, tolerance(5e-4));
    // No point of the hand is 0.25 m from its base, or from a joint's axis: samples every millimetre at most.
    const VectorXd change = to - from;
    const double way_m = 0.1 * change.head<3>().norm() + 0.25 * change.segment<3>(3).norm() +
                         0.25 * change.tail(hand_.tree.dofs()).cwiseAbs().sum();
    const double least = sampled(from, to, 2 + static_cast<int>(way_m / 1e-3));
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
  EXPECT_GT(free, trials(1500) / 5);
  EXPECT_GT(refused, trials(1500) / 5);
  EXPECT_LE(wrongly_refused, refused / 100);
  EXPECT_LE(undecided, refused / 100);
}

TEST_F(CertificateTest, ATunnelBetweenTwoFreeEndsIsSeen) {
  VectorXd from = floating_.state(Pose(Eigen::Translation3d(0.6, 0, 0)), hand_.open_rad), to = from;
  to[0] = -from[0];
  Prover prover(floating_, {{{&field_}}, {}});
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
  Prover alone(floating_, {{{&field_}}, {}});
  Prover table(floating_, {{{&field_}}, geometry::Plane{Vec3::UnitZ(), 0.25}});
  EXPECT_EQ(alone.certify({x, down}, tolerance(0)).outcome, Proof::free);
  EXPECT_EQ(table.certify({x, down}, tolerance(0)).outcome, Proof::collides);
}

TEST_F(CertificateTest, LinksWithLeaveMayTouch) {
  const VectorXd x = floating_.state(Pose(Eigen::Translation3d(0, 0, -0.1)), hand_.open_rad);
  Prover prover(floating_, {{{&field_}}, {}});
  const auto strict = prover.certify({x, x}, tolerance(0));
  ASSERT_EQ(strict.outcome, Proof::collides);
  EXPECT_EQ(prover.certify({x, x}, tolerance(1)).outcome, Proof::free);
}

/// The arm with its hand beside the ball, and random moves of it that pass near.
class ArmCertificateTest : public CertificateTest {
 protected:
  VectorXd random_posture(std::mt19937_64& random) const {
    std::uniform_real_distribution<> unit(-1, 1);
    VectorXd x = armed_.body.open_rad;
    for (Eigen::Index i = 0; i < x.size(); ++i)
      x[i] = std::clamp(x[i] + (i < 7 ? 0.7 : 0.4) * unit(random), armed_.body.tree.lower_rad[i],
                        armed_.body.tree.upper_rad[i]);
    return x;
  }
  std::vector<hands::PlacedCapsule> placed(const VectorXd& x) const {
    Mover::Placed at;
    std::vector<hands::PlacedCapsule> capsules;
    arm_.place(x, at);
    hands::place_capsules(armed_.body, at.X_OH, at.X_HL, capsules);
    return capsules;
  }
  double clearance(const VectorXd& x) const {
    double least = 1;
    for (const auto& c : placed(x)) {
      const Vec3 along = c.b - c.a;
      const double s = std::clamp(-c.a.dot(along) / std::max(along.squaredNorm(), 1e-12), 0.0, 1.0);
      least = std::min(least, (c.a + s * along).norm() - radius_m - c.radius_m);
    }
    return least;
  }
  /// States so near to each other that no point of the arm moves by more than a millimetre between them.
  int samples(const VectorXd& change) const {
    return 2 + static_cast<int>(change.cwiseAbs().sum() * 1.4 / 1e-3);
  }

  const hands::ArmedHand armed_ = hands::on_arm(hands::load_arm("kuka_lwr4"), hand_);
  const Mover arm_ = Mover::standing(armed_.body, Pose(Eigen::Translation3d(-0.62, 0, -0.25)));
  std::vector<double> tolerances(double m) const {
    return std::vector<double>(armed_.body.tree.links.size(), m);
  }
};

TEST_F(ArmCertificateTest, NoPointTravelsFurtherThanTheBound) {
  std::mt19937_64 random(6);
  Prover prover(arm_, {{{&field_}}, {}});
  for (int i = 0; i < 200; ++i) {
    const VectorXd x = random_posture(random), change = 0.3 * (random_posture(random) - x);
    for (double part : {1.0, 0.5, -1.0}) {
      const auto here = placed(x), moved = placed(x + part * change);
      prover.look_at(x);
      for (std::size_t c = 0; c < moved.size(); ++c) {
        const double travel = std::max((moved[c].a - here[c].a).norm(), (moved[c].b - here[c].b).norm());
        const double bound = prover.near_travel_m(static_cast<int>(c), change);
        EXPECT_LE(travel, bound + 1e-12);
        EXPECT_LE(bound, prover.travel_m(static_cast<int>(c), change) + 1e-12);
      }
    }
  }
}

// As for the floating hand: samples every millimetre at most. The mesh is at most 5e-5 inside the ball.
TEST_F(ArmCertificateTest, NeverAcceptsWhatDenseSamplesRefuse) {
  std::mt19937_64 random(7);
  Prover prover(arm_, {{{&field_}}, {}});
  int free = 0, refused = 0, wrongly = 0, undecided = 0;
  const int rounds = trials(200);
  for (int i = 0; i < rounds; ++i) {
    const VectorXd from = random_posture(random), to = from + 0.3 * (random_posture(random) - from);
    const auto answer = prover.certify({from, to}, tolerances(5e-4));
    double least = 1;
    const int count = samples(to - from);
    for (int k = 0; k <= count; ++k)
      least = std::min(least, clearance(from + double(k) / count * (to - from)));
    undecided += answer.outcome == Proof::undecided;
    if (answer.outcome == Proof::free) {
      ++free;
      EXPECT_GE(least, -5e-4 - 5e-5);
      EXPECT_LE(answer.clearance_m, least + 5e-5);
    } else {
      ++refused;
      wrongly += least > 0.001;
    }
  }
  std::printf("arm: %d free, %d refused, %d of them wrongly, %d undecided\n", free, refused, wrongly,
              undecided);
  EXPECT_GT(free, rounds / 10);
  EXPECT_GT(refused, rounds / 20);
  EXPECT_LE(wrongly, std::max(1, rounds / 100));
}

// Far from the ball: only the body itself can be met. Gaps by hands::capsule_gap_m every millimetre.
TEST_F(ArmCertificateTest, TheBodyMeetsItself) {
  std::mt19937_64 random(8);
  const Mover away = Mover::standing(armed_.body, Pose(Eigen::Translation3d(-5, 0, 0)));
  VectorXd open = armed_.body.open_rad;
  const auto pairs = self_pairs(armed_.body, open);
  EXPECT_GT(pairs.size(), 50u);
  Prover prover(away, {{{&field_}}, {}}, pairs);
  int free = 0, refused = 0, wrongly = 0;
  const int rounds = std::min(trials(100), 2000);
  for (int i = 0; i < rounds; ++i) {
    VectorXd from = random_posture(random), to = random_posture(random);
    std::uniform_real_distribution<> unit(0, 1);
    for (VectorXd* x : {&from, &to}) {  // elbow and wrist fold the hand towards the upper arm
      (*x)[3] = 2.09 - 0.3 * unit(random);
      (*x)[5] = 2.09 - 0.8 * unit(random);
    }
    to = from + 0.4 * (to - from);
    const auto answer = prover.certify({from, to}, tolerances(5e-4));
    double least = 1;
    const int count = samples(to - from) / 2;
    for (int k = 0; k <= count; ++k) {
      const auto capsules = placed(from + double(k) / count * (to - from));
      for (const auto& [a, b] : pairs)
        least = std::min(least, hands::capsule_gap_m(capsules[a], capsules[b]));
    }
    if (answer.outcome == Proof::free) {
      ++free;
      EXPECT_GE(least, -5e-4);
      EXPECT_LE(answer.self_clearance_m, std::max(least, 0.0) + 1e-9);
    } else {
      ++refused;
      wrongly += least > 0;
      if (answer.outcome == Proof::collides) {
        EXPECT_GE(answer.other, 0);
      }
    }
  }
  EXPECT_GT(free, rounds / 20);
  EXPECT_GT(refused, rounds / 20);
  EXPECT_LE(wrongly, std::max(1, rounds / 100));
  std::printf("self: %d free, %d refused, %d of them wrongly\n", free, refused, wrongly);
}

// A second field stands for what a map holds; the certificate says what was met.
TEST_F(CertificateTest, ItSaysWhatWasMet) {
  const auto other = geometry::build_distance_field(datasets::icosphere(0.03, 3), {24, 0.1, 1});
  const VectorXd x = floating_.state(Pose(Eigen::Translation3d(0, 0, 0.3)), hand_.open_rad);
  VectorXd down = x;
  down[2] -= 6;
  Prover both(floating_, {{{&field_}, {&other, 0.5}}, {}});  // half a metre too large: it is met first
  const auto answer = both.certify({x, down}, tolerance(5e-4));
  EXPECT_EQ(answer.outcome, Proof::collides);
  EXPECT_EQ(answer.other, Certificate::of_support - 1);
  Prover one(floating_, {{{&field_}}, {}});
  EXPECT_EQ(one.certify({x, down}, tolerance(5e-4)).other, Certificate::of_object);
}

}  // namespace
}  // namespace geocage::motion
