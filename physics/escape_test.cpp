#include "physics/escape_test.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace geocage::physics {
namespace {

using geometry::Pose;
using geometry::Vec3;

const std::vector<Vec3>& ways() {
  static const std::vector<Vec3> directions = hands::sphere_directions(2);
  return directions;
}

std::vector<Vec3> ways_across(const Vec3& axis) {
  constexpr int count = 40;
  const Eigen::Matrix3d R = geometry::frame_from_z(axis);
  std::vector<Vec3> across;
  for (int i = 0; i < count; ++i) {
    const double angle = 2 * std::numbers::pi * i / count;
    across.push_back(R * Vec3(std::cos(angle), std::sin(angle), 0));
  }
  return across;
}

double support(const std::vector<hands::PlacedCapsule>& capsules, const Vec3& way) {
  double farthest = -1e300;
  for (const hands::PlacedCapsule& capsule : capsules)
    farthest = std::max(farthest, std::max(way.dot(capsule.a), way.dot(capsule.b)) + capsule.radius_m);
  return farthest;
}

Ball ball_of(const std::vector<hands::PlacedCapsule>& capsules) {
  Eigen::AlignedBox3d box;
  for (const hands::PlacedCapsule& capsule : capsules) box.extend(capsule.a), box.extend(capsule.b);
  Ball ball{capsules.empty() ? Vec3(Vec3::Zero()) : Vec3(box.center()), 0};
  for (const hands::PlacedCapsule& capsule : capsules)
    for (const Vec3& end : {capsule.a, capsule.b})
      ball.radius_m = std::max(ball.radius_m, (end - ball.center).norm() + capsule.radius_m);
  return ball;
}

}  // namespace

EscapeTest::EscapeTest(const ObjectBody& object, double radius_m, std::vector<hands::PlacedCapsule> hand_O)
    : field_(*object.field),
      capsules_(std::move(hand_O)),
      object_{object.X_OB.translation(), radius_m},
      hand_(ball_of(capsules_)) {
  for (const Vec3& way : ways()) support_m_.push_back(support(capsules_, way));
}

bool EscapeTest::gone(const Pose& X_WO) const {
  return (X_WO * object_.center - hand_.center).norm() > object_.radius_m + hand_.radius_m;
}

bool EscapeTest::beside(const Pose& X_WO) const {
  const Vec3 center = X_WO * object_.center;
  for (std::size_t i = 0; i < support_m_.size(); ++i)
    if (ways()[i].dot(center) > support_m_[i]) return true;
  return false;
}

bool EscapeTest::straight_way_out(const Pose& X_WO, const std::optional<Vec3>& locked_W) const {
  const Pose X_OW = X_WO.inverse();
  std::vector<hands::PlacedCapsule> hand_O = capsules_;
  for (hands::PlacedCapsule& capsule : hand_O) capsule.a = X_OW * capsule.a, capsule.b = X_OW * capsule.b;
  const double travel_m = object_.radius_m + hand_.radius_m;
  const std::vector<Vec3> tried = locked_W ? ways_across(*locked_W) : ways();
  return std::ranges::any_of(tried, [&](const Vec3& way_W) {  // the hand moves the other way instead
    return !hands::free_travel_m(field_, hand_O, -(X_OW.linear() * way_W), travel_m).has_value();
  });
}

double radius_about_m(const geometry::TriangleMesh& mesh, const Vec3& center) {
  double radius = 0;
  for (const Vec3& vertex : mesh.vertices) radius = std::max(radius, (vertex - center).norm());
  return radius;
}

}  // namespace geocage::physics
