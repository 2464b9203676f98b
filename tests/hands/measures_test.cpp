#include "hands/measures.h"

#include <numbers>

#include <gtest/gtest.h>

namespace geocage::hands {
namespace {

constexpr double pi = std::numbers::pi;

/// An arc of a circle about z, from `from` to `to`.
topology::Polyline arc(double radius, double from, double to, int points = 12) {
  topology::Polyline line;
  for (int i = 0; i <= points; ++i) {
    const double at = from + (to - from) * i / points;
    line.emplace_back(radius * std::cos(at), radius * std::sin(at), 0.01);
  }
  return line;
}

TEST(WrapAngles, OfArcsAreTheirAngles) {
  const auto wraps = wrap_angles_rad({arc(0.04, 0, 2), arc(0.03, 3, 0.5)}, Vec3::Zero(), Vec3::UnitZ());
  ASSERT_EQ(wraps.size(), 2u);
  EXPECT_NEAR(wraps[0], 2, 1e-12);
  EXPECT_NEAR(wraps[1], 2.5, 1e-12);
}

TEST(ContactWrap, IsAFullTurnLessTheLargestGap) {
  const auto at = [](double angle) {
    Contact contact;
    contact.p_O = Vec3(std::cos(angle), std::sin(angle), 0.3);
    return contact;
  };
  EXPECT_NEAR(contact_wrap_rad({at(0), at(2), at(4)}, Vec3::Zero(), Vec3::UnitZ()), 4, 1e-12);
  EXPECT_NEAR(contact_wrap_rad({at(0.5), at(0.1)}, Vec3::Zero(), Vec3::UnitZ()), 0.4, 1e-12);
  EXPECT_EQ(contact_wrap_rad({at(1)}, Vec3::Zero(), Vec3::UnitZ()), 0);
}

TEST(EnclosedShare, OfABallInViewIsItsCap) {
  // A ball of radius r at distance d hides the share (1 - cos a) / 2 of directions, sin a = r / d; the 162
  // directions stand for about 0.08 rad each way, so the cap of 0.5 rad is known to a fifth.
  const double a = 0.8;
  const PlacedCapsule ball{Vec3(0, 0, 0.1), Vec3(0, 0, 0.1), 0.1 * std::sin(a)};
  EXPECT_NEAR(enclosed_share({ball}, Vec3::Zero()), (1 - std::cos(a)) / 2, 0.03);
  EXPECT_EQ(enclosed_share({}, Vec3::Zero()), 0);
  EXPECT_EQ(enclosed_share({{Vec3(0, 0, 0), Vec3(0, 0, 0.01), 0.02}}, Vec3::Zero()), 1) << "inside of it";
}

TEST(AxisLinking, IsOneAroundTheAxisAndNothingBesideIt) {
  const std::vector<topology::Polyline> around = {arc(0.04, -0.3, -3.0), arc(0.04, 0.3, 3.0)};
  const Vec3 palm(0.05, 0, 0.01);
  const auto loops = hand_loops(around, palm);
  // 2 m of a line seen from a loop of 5 cm: 1 - (0.05 / 1)^2 / 2.
  EXPECT_NEAR(axis_linking(loops, Vec3::Zero(), Vec3::UnitZ()), 1, 2e-3);
  EXPECT_NEAR(axis_linking(loops, Vec3(0.2, 0, 0), Vec3::UnitZ()), 0, 2e-3);
  EXPECT_NEAR(axis_linking(loops, Vec3::Zero(), Vec3::UnitX()), 0, 0.02) << "it lies beside the loop's plane";
  EXPECT_EQ(axis_linking(hand_loops({around[0]}, palm), Vec3::Zero(), Vec3::UnitZ()), 0)
      << "one finger closes no loop";
}

TEST(HandleLinking, CountsHowOftenTheHandGoesThroughTheHandle) {
  const auto loops = hand_loops({arc(0.04, -0.3, -3.0), arc(0.04, 0.3, 3.0)}, Vec3(0.05, 0, 0.01));
  const auto ring = [](double x) {  // around y, through the plane of the hand at x - 0.02 and x + 0.02
    topology::Polyline line;
    for (int i = 0; i < 20; ++i)
      line.emplace_back(x + 0.02 * std::cos(i * pi / 10), 0.003, 0.01 + 0.02 * std::sin(i * pi / 10));
    return line;
  };
  EXPECT_EQ(handle_linking(loops, {ring(0.04)}), 1)
      << "one side of the ring is inside the hand's loop, one outside";
  EXPECT_EQ(handle_linking(loops, {ring(0)}), 0) << "both are inside";
  EXPECT_EQ(handle_linking(loops, {ring(0.2), ring(0)}), 0);
  EXPECT_EQ(handle_linking(loops, {}), 0);
}

TEST(FingerLines, OfTheOpenHandFollowItsKinematics) {
  const Hand hand = load_hand("schunk_sdh");
  Eigen::VectorXd q = hand.open_rad;
  for (const Finger& finger : hand.fingers)
    for (int d : finger.dofs) q[d] = 0;
  const auto lines = finger_lines(hand, Pose::Identity(), q);
  ASSERT_EQ(lines.size(), 3u);
  for (const auto& line : lines) {
    EXPECT_NEAR(line.back().z(), 0.091 + 0.0865 + 0.055, 1e-9)
        << "straight up: joint 2, joint 3, its capsule's end";
    for (std::size_t i = 1; i < line.size(); ++i) EXPECT_GE(line[i].z(), line[i - 1].z());
  }
  const auto sheet = hand_sheet(lines, hand.palm_H, hand.approach_H);
  EXPECT_EQ(sheet.triangles.size(), 3u * (1 + 2 * 5));
  const auto report = geometry::check_mesh(sheet);
  EXPECT_EQ(report.euler, 1) << "a cup: a disc in topology";
  EXPECT_EQ(report.inconsistent_edges, 0);
}

}  // namespace
}  // namespace geocage::hands
