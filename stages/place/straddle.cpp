#include "stages/place/straddle.h"

#include <algorithm>

#include "hands/caging.h"

namespace geocage::stages {

using geometry::Pose;
using geometry::Vec3;
using hands::PlacedCapsule;

namespace {

/// The capsules of one finger.
std::vector<PlacedCapsule> jaw(const hands::Hand& hand, const hands::Finger& finger, const Pose& X_OH,
                               const Eigen::VectorXd& q) {
  std::vector<Pose> X_HL;
  std::vector<PlacedCapsule> all, own;
  hands::forward_kinematics(hand.tree, q, X_HL);
  hands::place_capsules(hand, X_OH, X_HL, all);
  for (std::size_t i = 0; i < all.size(); ++i)
    if (std::find(finger.links.begin(), finger.links.end(), hand.capsules[i].link) != finger.links.end())
      own.push_back(all[i]);
  return own;
}

bool is_free(const geometry::SignedDistanceField& field, const std::vector<PlacedCapsule>& capsules) {
  return std::all_of(capsules.begin(), capsules.end(), [&](const PlacedCapsule& capsule) {
    return hands::capsule_distance(field, capsule).distance_m >= 0;
  });
}

/// How far the jaw, set back by `back_m`, gets along `way` from where it stands.
std::optional<double> travel_m(const geometry::SignedDistanceField& field,
                               std::vector<PlacedCapsule> capsules, const Vec3& way, double back_m,
                               double ahead_m) {
  for (PlacedCapsule& capsule : capsules) {
    capsule.a -= back_m * way;
    capsule.b -= back_m * way;
  }
  const auto travel = hands::free_travel_m(field, capsules, way, back_m + ahead_m);
  return travel ? std::optional(*travel - back_m) : std::nullopt;
}

}  // namespace

bool is_gripper(const hands::Hand& hand) {
  return hand.fingers.size() == 2 && hand.fingers[0].dofs.size() == 1 &&
         hand.fingers[0].dofs == hand.fingers[1].dofs;
}

Vec3 centring_m(const hands::Hand& hand, const geometry::SignedDistanceField& field, const Pose& X_OH,
                const Eigen::VectorXd& q) {
  const int dof = hand.fingers[0].dofs[0];
  Eigen::VectorXd closed = q;
  closed[dof] = hand.closing_rad[dof] > 0 ? hand.tree.upper_rad[dof] : hand.tree.lower_rad[dof];
  const auto left = jaw(hand, hand.fingers[0], X_OH, q), right = jaw(hand, hand.fingers[1], X_OH, q);
  const Vec3 left_way = jaw(hand, hand.fingers[0], X_OH, closed)[0].a - left[0].a,
             right_way = jaw(hand, hand.fingers[1], X_OH, closed)[0].a - right[0].a;
  const double stroke_m = (left_way - right_way).norm();
  if (stroke_m < 1e-9) return Vec3::Zero();
  const Vec3 way = (left_way - right_way) / stroke_m;
  const Eigen::Vector3i box(field.nodes[0] - 1, field.nodes[1] - 1, field.nodes[2] - 1);
  const double back_m =
      is_free(field, left) && is_free(field, right) ? 0 : field.cell_m * box.cast<double>().norm();
  const auto of_left = travel_m(field, left, way, back_m, stroke_m + back_m),
             of_right = travel_m(field, right, -way, back_m, stroke_m + back_m);
  if (!of_left || !of_right) return Vec3::Zero();
  return (*of_left - *of_right) / 2 * way;
}

}  // namespace geocage::stages
