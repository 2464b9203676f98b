#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "geometry/pose.h"

namespace geocage::hands {

using geometry::Pose;
using geometry::Vec3;

/// One joint of a tree: X_PC(q) = X_PJ * motion(axis_J, q).
struct Joint {
  enum class Type { fixed, revolute, prismatic };
  std::string name;
  Type type = Type::fixed;
  int parent_link = 0, child_link = 0;
  Pose X_PJ = Pose::Identity();
  Vec3 axis_J = Vec3::UnitZ();
  int dof = 0;                            ///< index into q; meaningful unless fixed
  double multiplier = 1, offset_rad = 0;  ///< joint value = multiplier * q[dof] + offset (mimic joints)
  double lower_rad = 0, upper_rad = 0;    ///< metres for prismatic joints, infinite for continuous ones
  double velocity_limit_rad_s = 0, effort_limit_nm = 0;
};

/// A mesh of a URDF: a vertex v of the file lies at X_LM * (scale * v) in its link's frame L.
struct LinkMesh {
  int link = 0;
  Pose X_LM = Pose::Identity();
  Vec3 scale = Vec3::Ones();
  std::string uri;             ///< as the URDF has it
  std::filesystem::path file;  ///< that read_urdf found
  bool collision = false;
};

/// A kinematic tree from a URDF: constant after loading. Links and joints are in depth-first order, parents
/// first; link 0 is the base H. q holds the independent joints in the order of `dof_names`; their limits are
/// narrowed to what their mimic joints allow.
struct KinematicTree {
  std::vector<std::string> links;
  std::vector<Joint> joints;  ///< joint i moves link i + 1
  std::vector<std::string> dof_names;
  Eigen::VectorXd lower_rad, upper_rad, velocity_limit_rad_s, effort_limit_nm;
  std::vector<LinkMesh> meshes;

  int moving_joints() const;  ///< those that mimic others counted too
  int dofs() const { return static_cast<int>(dof_names.size()); }
  int link(const std::string& name) const;  ///< UserError when there is none
  int dof(const std::string& name) const;   ///< UserError when there is none
};

/// Errors (UserError, configuration), each naming the link or joint: not a URDF, cycle, unknown link, a type
/// of joint other than fixed, revolute, continuous or prismatic, limits missing or reversed, a number that is
/// not finite, an offset beyond 10 m, a mesh scale outside [1e-4, 1e4], mimic of itself, of nobody or in a
/// circle. read_urdf also refuses a mesh whose file isn't there.
KinematicTree parse_urdf(const std::string& text, const std::string& where);
KinematicTree read_urdf(const std::filesystem::path& file);

using FrameJacobian = Eigen::Matrix<double, 6, Eigen::Dynamic>;

/// What changes with the posture of one tree. Made once, then filled again and again without allocation.
struct KinematicData {
  explicit KinematicData(const KinematicTree& tree);
  std::vector<Pose> X_HL;        ///< of every link
  FrameJacobian link_jacobians;  ///< 6 x (links x dofs): those of all links side by side
  int dofs = 0;

  /// d(v, w)/d(dq/dt) of the frame of `link`, 6 x dofs: velocity of its origin, then angular velocity, both
  /// in the axes of H.
  auto jacobian(int link) const { return link_jacobians.middleCols(Eigen::Index{link} * dofs, dofs); }
};

/// X_HL of every link. `X_HL` is resized on first use only. O(links).
void forward_kinematics(const KinematicTree& tree, const Eigen::VectorXd& q, std::vector<Pose>& X_HL);

/// The Jacobians of all links in one pass, from poses that forward_kinematics filled: a link moves as its
/// parent does, seen from its own origin, and as its joint does. O(links x dofs).
void link_jacobians(const KinematicTree& tree, KinematicData& data);

/// dp_H/dq of a point fixed in `link` at p_H, 3 x dofs, from poses that forward_kinematics filled. O(depth).
void point_jacobian(const KinematicTree& tree, const std::vector<Pose>& X_HL, int link, const Vec3& p_H,
                    Eigen::Ref<Eigen::Matrix3Xd> jacobian);

/// As point_jacobian with the angular velocity below, 6 x dofs: of a frame fixed in `link` with its origin at
/// p_H.
void frame_jacobian(const KinematicTree& tree, const std::vector<Pose>& X_HL, int link, const Vec3& p_H,
                    Eigen::Ref<FrameJacobian> jacobian);

}  // namespace geocage::hands
