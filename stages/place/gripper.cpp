#include "stages/place/gripper.h"

#include <algorithm>
#include <limits>

namespace geocage::stages {

using geometry::Pose;
using geometry::Vec3;

namespace {

constexpr double touch_m = 2e-5;         // as near as a capsule's distance is known
constexpr double largest_step_m = 0.02;  // the field is too large beyond its free border
constexpr int most_steps = 200;          // a jaw that slides along a surface takes shorter and shorter ones

/// How far the capsules move along the unit vector before one touches; nothing when none does.
std::optional<double> way_to_touch_m(const geometry::SignedDistanceField& field,
                                     const std::vector<hands::PlacedCapsule>& capsules, const Vec3& way_O,
                                     double farthest_m) {
  double moved_m = 0;
  for (int step = 0; step < most_steps && moved_m < farthest_m; ++step) {
    double free_m = largest_step_m;
    for (const hands::PlacedCapsule& start : capsules)
      free_m = std::min(free_m, hands::capsule_distance(field, {start.a + moved_m * way_O,
                                                                start.b + moved_m * way_O, start.radius_m})
                                    .distance_m);
    if (free_m <= touch_m) return moved_m;
    moved_m += free_m;
  }
  return std::nullopt;
}

bool belongs(const hands::Finger& finger, int link) {
  return std::find(finger.links.begin(), finger.links.end(), link) != finger.links.end();
}

}  // namespace

std::optional<Gripper> gripper_of(const hands::Hand& hand) {
  if (hand.fingers.size() != 2) return std::nullopt;
  const auto &first = hand.fingers[0], &second = hand.fingers[1];
  if (first.dofs.size() != 1 || second.dofs != first.dofs) return std::nullopt;
  Gripper gripper{first.dofs.front()};
  std::vector<Pose> X_HL;
  hands::forward_kinematics(hand.tree, hand.open_rad, X_HL);
  const auto way = [&](const hands::Finger& finger) -> Vec3 {
    const hands::Joint& joint = hand.tree.joints[finger.links.front() - 1];
    if (joint.type != hands::Joint::Type::prismatic || joint.dof != gripper.dof) return Vec3::Zero();
    return hand.closing_rad[gripper.dof] * joint.multiplier *
           (X_HL[joint.child_link].linear() * joint.axis_J);
  };
  gripper.closing_H = way(first);
  // Opposite and equally fast, up to the rounding of the axes in the URDF.
  if (gripper.closing_H.norm() < 0.5 || (gripper.closing_H + way(second)).norm() > 1e-6) return std::nullopt;
  gripper.closing_H.normalize();
  const auto open = hands::placed_capsules(hand, Pose::Identity(), hand.open_rad);
  gripper.opening_m = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < open.size(); ++i)
    for (std::size_t j = 0; j < open.size(); ++j)
      if (belongs(first, hand.capsules[i].link) && belongs(second, hand.capsules[j].link))
        gripper.opening_m = std::min(gripper.opening_m, hands::capsule_gap_m(open[i], open[j]));
  for (const auto& [a, b, radius_m] : open)
    for (const Vec3& end : {a, b})
      gripper.reach_m = std::max(gripper.reach_m, (end - hand.palm_H).dot(hand.approach_H) + radius_m);
  return gripper;
}

Pose centered(const Gripper& gripper, const hands::Hand& hand, const geometry::SignedDistanceField& field,
              const Pose& X_OH, const std::vector<hands::PlacedCapsule>& placed) {
  const Vec3 way_O = X_OH.linear() * gripper.closing_H;
  const double farthest_m = 2 * (hand.tree.upper_rad[gripper.dof] - hand.tree.lower_rad[gripper.dof]);
  const auto travel_m = [&](int finger, const Vec3& along) {
    std::vector<hands::PlacedCapsule> jaw;
    for (std::size_t i = 0; i < placed.size(); ++i)
      if (belongs(hand.fingers[finger], hand.capsules[i].link)) jaw.push_back(placed[i]);
    return way_to_touch_m(field, jaw, along, farthest_m);
  };
  const auto first_m = travel_m(0, way_O), second_m = travel_m(1, -way_O);
  Pose moved = X_OH;
  if (first_m && second_m) moved.translation() += 0.5 * (*first_m - *second_m) * way_O;
  return moved;
}

double opposition(const Gripper& gripper, const hands::Hand& hand, const Pose& X_OH,
                  const std::vector<hands::Contact>& contacts) {
  const Vec3 way_O = X_OH.linear() * gripper.closing_H;
  double worst = 1;
  for (int finger : {0, 1}) {
    // A jaw presses along its way, against the outward normal.
    double best = -1;
    for (const hands::Contact& contact : contacts)
      if (belongs(hand.fingers[finger], contact.link))
        best = std::max(best, contact.n_O.dot(finger == 0 ? -way_O : way_O));
    worst = std::min(worst, best);
  }
  return worst;
}

}  // namespace geocage::stages
