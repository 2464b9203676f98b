#include "hands/caging.h"

#include <gtest/gtest.h>

#include "tests/hands/analytic_field.h"

namespace geocage::hands {
namespace {

constexpr double radius_m = 0.03;

geometry::SignedDistanceField ball() {
  const Vec3 corner = Vec3::Constant(radius_m + 0.03);
  return tests::sampled_field([](const Vec3& p) { return p.norm() - radius_m; }, -corner, corner, 0.002);
}

PlacedCapsule point(const Vec3& p, double radius) {
  return {p, p, radius};
}

std::vector<Contact> contacts(const std::vector<Vec3>& normals) {
  std::vector<Contact> list;
  for (const Vec3& n : normals) list.push_back({.n_O = n});
  return list;
}

TEST(SphereDirections, AreAnIcosphere) {
  for (const auto& [splits, size] : {std::pair{0, 12u}, {1, 42u}, {2, 162u}}) {
    const auto directions = sphere_directions(splits);
    ASSERT_EQ(directions.size(), size);
    Vec3 sum = Vec3::Zero();
    Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
    for (const Vec3& d : directions) {
      EXPECT_NEAR(d.norm(), 1, 1e-15);
      sum += d;
      squares += d * d.transpose();
    }
    // The icosahedral group leaves no vector and no quadratic form but multiples of the identity.
    EXPECT_LT(sum.norm(), 1e-12);
    EXPECT_LT((squares - size / 3.0 * Eigen::Matrix3d::Identity()).norm(), 1e-11);
  }
}

TEST(BlockedShare, OfABallBetweenBallsFollowsTheClosedForm) {
  const auto field = ball();
  const double finger = 0.02, travel = 0.06;
  std::vector<PlacedCapsule> hand;
  for (const Vec3& at : {Vec3(0.052, 0, 0), Vec3(0, -0.051, 0), Vec3(0.01, 0.02, 0.06), Vec3(0, 0, -0.2)}) {
    hand.push_back(point(at, finger));
    int hits = 0;
    const auto directions = sphere_directions(1);
    for (const Vec3& d : directions) {
      const auto hit = [&](const PlacedCapsule& c) {
        const double s = std::clamp(c.a.dot(d), 0.0, travel);  // of the nearest passage
        return (c.a - s * d).norm() < radius_m + finger - 0.0005;
      };
      hits += std::any_of(hand.begin(), hand.end(), hit);
    }
    EXPECT_DOUBLE_EQ(blocked_share(field, hand, travel), hits / 42.0) << hand.size() << " balls";
  }
}

TEST(BlockedShare, IsOneInABoxAndZeroInTheOpen) {
  const auto field = ball();
  std::vector<PlacedCapsule> box;
  for (int axis = 0; axis < 3; ++axis)
    for (double side : {-1.0, 1.0}) box.push_back(point(side * (radius_m + 0.101) * Vec3::Unit(axis), 0.1));
  EXPECT_EQ(blocked_share(field, box), 1);
  EXPECT_EQ(blocked_share(field, {point(Vec3(1, 0, 0), 0.1)}), 0);
}

TEST(ClosureMargin, OfKnownContacts) {
  const double third = 1.0 / 3;
  const auto axes =
      contacts({Vec3::UnitX(), -Vec3::UnitX(), Vec3::UnitY(), -Vec3::UnitY(), Vec3::UnitZ(), -Vec3::UnitZ()});
  const auto tetrahedron = contacts({Vec3(1, 1, 1).normalized(), Vec3(1, -1, -1).normalized(),
                                     Vec3(-1, 1, -1).normalized(), Vec3(-1, -1, 1).normalized()});
  // The exact minimum over the sphere is a lower bound; a direction of the 162 lies within 0.2 rad of its
  // place.
  EXPECT_GE(closure_margin(axes), std::sqrt(third));
  EXPECT_LE(closure_margin(axes), std::cos(std::acos(std::sqrt(third)) - 0.2));
  EXPECT_GE(closure_margin(tetrahedron), third);
  EXPECT_LE(closure_margin(tetrahedron), std::cos(std::acos(third) - 0.2));
  EXPECT_NEAR(closure_margin(contacts({Vec3::UnitZ(), -Vec3::UnitZ()})), 0, 1e-15)
      << "it slides out sideways";
  EXPECT_NEAR(closure_margin(contacts({sphere_directions(0)[3]})), -1, 1e-15);
  EXPECT_EQ(closure_margin({}), -1);
}

}  // namespace
}  // namespace geocage::hands
