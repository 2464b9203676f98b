#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "hands/kinematics.h"

namespace geocage::hands {

/// Points within radius of the segment a-b, fixed in a link frame L. One set of capsules serves closing,
/// planning and physics alike.
struct Capsule {
  int link = 0;
  Vec3 a_L = Vec3::Zero(), b_L = Vec3::Zero();
  double radius_m = 0;
};

/// Joints (dof indices, proximal first) of one finger in the order they close, and the link that each one
/// moves.
struct Finger {
  std::string name;
  std::vector<int> dofs, links;
};

/// A hand as `hand.toml` and its URDF describe it (docs in hands/README.md).
struct Hand {
  std::string name;
  KinematicTree tree;
  std::vector<Capsule> capsules;
  std::vector<Finger> fingers;
  Vec3 palm_H = Vec3::Zero();           ///< centre of the palm's surface
  Vec3 approach_H = Vec3::UnitZ();      ///< from the palm towards the object
  Vec3 flexion_axis_H = Vec3::UnitY();  ///< normal of the plane that the fingers close in
  std::string spread_dof;               ///< empty when there is none
  double finger_length_m = 0, ball_radius_m = 0;
  std::vector<double> ball_radii_m;
  Eigen::VectorXd open_rad,
      closing_rad;     ///< posture to start closing from; signed closing direction of each dof
  std::string sha256;  ///< of the name, hand.toml and the URDF
};

/// By name (a folder of the project's `hands/`), by folder, or by path of a URDF beside its hand.toml. The
/// project's `hands/` is that of the source tree, or of the folder in the environment variable GEOCAGE_DATA.
/// Errors (UserError, configuration): unknown name (the nearest one is named), missing, wrong or unknown
/// field (with line and column), whatever read_urdf refuses.
Hand load_hand(const std::string& name_or_path);
/// Names of the hands that come with the project, sorted.
std::vector<std::string> hand_names();

/// Capsule ends in the world of `X_WH`: a_W and b_W of each capsule, in the order of `hand.capsules`.
struct PlacedCapsule {
  Vec3 a, b;
  double radius_m;
};
void place_capsules(const Hand& hand, const Pose& X_WH, const std::vector<Pose>& X_HL,
                    std::vector<PlacedCapsule>& placed);

}  // namespace geocage::hands
