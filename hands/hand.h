#pragma once
#include <optional>
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

/// Joints (dof indices, proximal first) of one finger that close, and all links that belong to the finger.
/// Two fingers may share a joint: the jaws of a gripper.
struct Finger {
  std::string name;
  std::vector<int> dofs, links;
};

/// How the joints of a finger are coupled while the hand closes.
enum class ClosingOrder {
  proximal_first,  ///< the first joints of all fingers until they stop, then the next ones
  together,        ///< all joints at once, each at its speed, each until it stops itself
  breakaway        ///< as together, but the distal joints go on alone only once the proximal link is stopped
};

/// A manipulator without kinematics: balls at the vertices of a geodesic ball, tied along the mesh's edges,
/// that tighten around the object (thesis 6.3.1).
struct NetDescription {
  double point_radius_m = 0;
  double offset_m = 0;       ///< of the points from the surface, along its normals, before the net tightens
  double stretch_share = 0;  ///< an edge may grow by this share of its length, and no more
};

/// A hand as `hand.toml` and its URDF describe it (docs in hands/README.md). A net of points has `net`, and a
/// tree of one link without joints, fingers or capsules.
struct Hand {
  std::string name;
  std::optional<NetDescription> net;
  KinematicTree tree;
  std::vector<Capsule> capsules;
  std::vector<Finger> fingers;
  Vec3 palm_H = Vec3::Zero();           ///< centre of the palm's surface
  Vec3 approach_H = Vec3::UnitZ();      ///< from the palm towards the object
  Vec3 flexion_axis_H = Vec3::UnitY();  ///< normal of the plane that the fingers close in
  std::string spread_dof;               ///< empty when there is none
  double finger_length_m = 0, ball_radius_m = 0;
  double torsion_m = 0;  ///< of soft pads: FrictionModel::torsion_m; 0 for hard ones
  std::vector<double> ball_radii_m;
  ClosingOrder closing_order = ClosingOrder::proximal_first;
  Eigen::VectorXd open_rad;     ///< pre-grasp: the posture to start closing from; metres where a joint slides
  Eigen::VectorXd closing_rad;  ///< +1 or -1, the way each dof closes; 0 where it does not
  Eigen::VectorXd closing_speed;  ///< of each dof relative to the others, positive
  std::string sha256;             ///< of the name, hand.toml, the URDF and those of the base
};

/// By name (a folder of the project's `hands/`), by folder, or by path of a URDF beside its hand.toml. The
/// project's `hands/` is that of the source tree, or of the folder in the environment variable GEOCAGE_DATA.
/// Errors (UserError, configuration): unknown name (the nearest one is named), missing, wrong or unknown
/// field (with file, line and column), whatever read_urdf refuses.
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
/// The same for one posture, for those that ask now and then: it allocates.
std::vector<PlacedCapsule> placed_capsules(const Hand& hand, const Pose& X_WH, const Eigen::VectorXd& q);

}  // namespace geocage::hands
