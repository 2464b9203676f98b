// Every hand that comes with the project, closed on a ball; and one that a user adds.
#include <fstream>

#include <gtest/gtest.h>

#include "hands/closing.h"
#include "hands/hand_check.h"
#include "tests/hands/analytic_field.h"
#include "tests/pipeline/scratch_folder.h"

namespace geocage::hands {
namespace {

constexpr double ball_m = 0.034;

geometry::SignedDistanceField ball() {
  const Vec3 corner = Vec3::Constant(0.12);
  return tests::sampled_field([](const Vec3& p) { return p.norm() - ball_m; }, -corner, corner, 0.004);
}

/// Exact distance of a capsule to the ball about the origin.
double distance_m(const PlacedCapsule& capsule) {
  const Vec3 d = capsule.b - capsule.a;
  const double t = d.norm() > 0 ? std::clamp(-capsule.a.dot(d) / d.squaredNorm(), 0.0, 1.0) : 0;
  return (capsule.a + t * d).norm() - ball_m - capsule.radius_m;
}

struct Best {
  Pose X_OH = Pose::Identity();
  ClosedHand closed;
};

/// The ball in front of the palm, at the distance where most fingers touch it.
Best close_on_ball(const Hand& hand, const geometry::SignedDistanceField& field) {
  Best best;
  for (double away_m = 0; away_m < 0.15; away_m += 0.005) {
    Pose X_OH = Pose::Identity();
    X_OH.translation() = -(hand.palm_H + away_m * hand.approach_H);
    ClosedHand closed = close_hand(hand, field, X_OH, hand.open_rad, {});
    if (closed.outcome == Closure::closed && closed.fingers_touching > best.closed.fingers_touching)
      best = {X_OH, std::move(closed)};
  }
  return best;
}

/// Smallest scalar product of two contact normals: -1 when the hand presses from opposite sides.
double opposition(const ClosedHand& closed) {
  double least = 1;
  for (const Contact& a : closed.contacts)
    for (const Contact& b : closed.contacts) least = std::min(least, a.n_O.dot(b.n_O));
  return least;
}

void expect_holds_ball(const Hand& hand) {
  const auto field = ball();
  const Best best = close_on_ball(hand, field);
  EXPECT_GE(best.closed.fingers_touching, std::min<std::size_t>(3, hand.fingers.size()));
  EXPECT_LT(opposition(best.closed), -0.5) << "fingers press from sides more than 120 degrees apart";
  for (const PlacedCapsule& capsule : placed_capsules(hand, best.X_OH, best.closed.q))
    EXPECT_GT(distance_m(capsule), -0.001) << "the most that a closed hand may penetrate";
  for (int dof = 0; dof < hand.tree.dofs(); ++dof) {
    const double moved = hand.closing_rad[dof] * (best.closed.q[dof] - hand.open_rad[dof]);
    EXPECT_GE(moved, 0) << hand.tree.dof_names[dof] << " opened";
    EXPECT_LE(best.closed.q[dof], hand.tree.upper_rad[dof] + 1e-12);
    EXPECT_GE(best.closed.q[dof], hand.tree.lower_rad[dof] - 1e-12);
  }
}

class ShippedHand : public testing::TestWithParam<std::string> {};

TEST_P(ShippedHand, ClosesAroundABall) {
  const Hand hand = load_hand(GetParam());
  if (hand.net) GTEST_SKIP() << "a net has no joints";
  expect_holds_ball(hand);
}

TEST_P(ShippedHand, MissesNothingAndSaysWhatPlacingNeeds) {
  const Hand hand = load_hand(GetParam());
  EXPECT_GT(hand.finger_length_m, 0);
  EXPECT_EQ(hand.ball_radii_m.size(), 4u);
  EXPECT_EQ(hand.sha256.size(), 64u);
  EXPECT_EQ(check_hand(hand).problems, std::vector<std::string>{});
}

std::string test_name(const testing::TestParamInfo<std::string>& hand) {
  return hand.param;
}
INSTANTIATE_TEST_SUITE_P(Hands, ShippedHand, testing::ValuesIn(hand_names()), test_name);

TEST(Hands, HaveTheJointsAndDrivesOfTheRealOnes) {
  struct Row {
    const char* name;
    int joints, drives;
    std::size_t fingers;
  };
  for (const Row& row :
       {Row{"schunk_sdh", 8, 7, 3}, Row{"six_finger", 12, 12, 6}, Row{"parallel_2f", 2, 1, 2},
        Row{"human_5f", 20, 20, 5}, Row{"barrett_bh280", 8, 7, 3}, Row{"allegro", 16, 16, 4},
        Row{"shadow", 24, 20, 5}}) {
    const Hand hand = load_hand(row.name);
    EXPECT_EQ(hand.tree.moving_joints(), row.joints) << row.name;
    EXPECT_EQ(hand.tree.dofs(), row.drives) << row.name;
    EXPECT_EQ(hand.fingers.size(), row.fingers) << row.name;
  }
}

// The page docs/add-a-hand.md shows these two files.
TEST(AddAHand, TakesTwoFilesAndNoCode) {
  std::ifstream page(std::string(GEOCAGE_SOURCE_TREE) + "/docs/add-a-hand.md");
  const std::string text{std::istreambuf_iterator<char>(page), {}};
  const auto block = [&](const std::string& language) {
    const auto start = text.find("```" + language + "\n") + language.size() + 4;
    return text.substr(start, text.find("```", start) - start);
  };
  tests::ScratchFolder scratch;
  std::filesystem::create_directory(scratch / "claw");
  std::ofstream(scratch.path() / "claw/claw.urdf") << block("xml");
  std::ofstream(scratch.path() / "claw/hand.toml") << block("toml");
  const Hand hand = load_hand((scratch / "claw").string());
  EXPECT_EQ(hand.name, "claw");
  EXPECT_EQ(check_hand(hand).problems, std::vector<std::string>{});
  expect_holds_ball(hand);
}

}  // namespace
}  // namespace geocage::hands
