// Kinematics allocate nothing once their data is made. The counter replaces malloc, so sanitizers keep
// theirs.
#include <atomic>
#include <cstdlib>

#include <gtest/gtest.h>

#include "hands/hand.h"

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define GEOCAGE_COUNTS 0
#else
#define GEOCAGE_COUNTS 1
#endif

namespace {
std::atomic<long> allocations{0};
}

#if GEOCAGE_COUNTS
extern "C" void* __libc_malloc(std::size_t size);
extern "C" void* malloc(std::size_t size) {
  ++allocations;
  return __libc_malloc(size);
}
#endif

namespace geocage::hands {
namespace {

TEST(Kinematics, AllocateNothingPerCall) {
  if (!GEOCAGE_COUNTS) GTEST_SKIP() << "a sanitizer counts here";
  for (const char* name : {"schunk_sdh", "shadow", "parallel_2f"}) {
    const Hand hand = load_hand(name);
    const Eigen::VectorXd q = hand.open_rad;
    KinematicData data(hand.tree);
    FrameJacobian jacobian(6, hand.tree.dofs());
    Eigen::Matrix3Xd of_point(3, hand.tree.dofs());
    std::vector<PlacedCapsule> placed(hand.capsules.size());
    const long before = allocations;
    for (int call = 0; call < 100; ++call) {
      forward_kinematics(hand.tree, q, data.X_HL);
      link_jacobians(hand.tree, data);
      frame_jacobian(hand.tree, data.X_HL, 2, Vec3(0, 0, 0.1), jacobian);
      point_jacobian(hand.tree, data.X_HL, 2, Vec3(0, 0, 0.1), of_point);
      place_capsules(hand, Pose::Identity(), data.X_HL, placed);
    }
    EXPECT_EQ(allocations - before, 0) << name;
    const std::vector<double> one(10);
    EXPECT_GT(allocations - before, 0) << "the counter counts";
  }
}

}  // namespace
}  // namespace geocage::hands
