#pragma once
#include <string>
#include <vector>

#include "hands/hand.h"

namespace geocage::hands {

/// An arm as `hands/arms/<name>/arm.toml` and its URDF describe it: a tree with capsules and the link that
/// carries a hand.
struct Arm {
  std::string name;
  KinematicTree tree;
  std::vector<Capsule> capsules;
  std::string flange;            ///< the link that carries
  Pose X_FH = Pose::Identity();  ///< where the hand's base sits on it
  Eigen::VectorXd rest_rad;      ///< a posture far from limits and singularities
};

/// By name (a folder of the project's `hands/arms/`) or by folder. Errors (UserError, configuration): unknown
/// name (the known ones are named), missing, wrong or unknown field (with file, line and column), whatever
/// read_urdf refuses.
Arm load_arm(const std::string& name_or_path);
std::vector<std::string> arm_names();

/// The hand at the end of the arm as one body: the arm's base is H, its joints come first, then the hand's;
/// links and joints of the hand keep their names unless the arm has the same ones, then "hand/" goes before.
/// Fingers, palm and closing are the hand's; `palm_H` and directions are in the hand's base link, whose index
/// is `hand_link`.
struct ArmedHand {
  Hand body;
  int hand_link = 0;
  int arm_dofs = 0;
};
ArmedHand on_arm(const Arm& arm, const Hand& hand);

}  // namespace geocage::hands
