// Kinematics allocate nothing once their data is made. The counter replaces malloc, so sanitizers keep
// theirs.
#include <cstdlib>

#include <gtest/gtest.h>

#include "hands/hand.h"
#include "tests/allocations.h"

namespace geocage::hands {
namespace {

TEST(Kinematics, AllocateNothingPerCall) {
  if (!tests::allocations_are_counted()) GTEST_SKIP() << "a sanitizer counts here";
  for (const char* name : {"schunk_sdh", "shadow", "parallel_2f"}) {
    const Hand hand = load_hand(name);
    const Eigen::VectorXd q = hand.open_rad;
    KinematicData data(hand.tree);
    FrameJacobian jacobian(6, hand.tree.dofs());
    Eigen::Matrix3Xd of_point(3, hand.tree.dofs());
    std::vector<PlacedCapsule> placed(hand.capsules.size());
    const long before = tests::allocations();
    for (int call = 0; call < 100; ++call) {
      forward_kinematics(hand.tree, q, data.X_HL);
      link_jacobians(hand.tree, data);
      frame_jacobian(hand.tree, data.X_HL, 2, Vec3(0, 0, 0.1), jacobian);
      point_jacobian(hand.tree, data.X_HL, 2, Vec3(0, 0, 0.1), of_point);
      place_capsules(hand, Pose::Identity(), data.X_HL, placed);
    }
    EXPECT_EQ(tests::allocations() - before, 0) << name;
    const std::vector<double> one(10);
    EXPECT_GT(tests::allocations() - before, 0) << "the counter counts";
  }
}

}  // namespace
}  // namespace geocage::hands
