#include "hands/kinematics.h"

#include <algorithm>

#include "pipeline/error.h"
#include "pipeline/nearest.h"

namespace geocage::hands {

namespace {

int index_of(const std::string& what, const std::string& name, const std::vector<std::string>& known) {
  const auto found = std::find(known.begin(), known.end(), name);
  if (found != known.end()) return static_cast<int>(found - known.begin());
  throw pipeline::UserError(pipeline::Fault::configuration, what, "there is no " + what + " '" + name + "'",
                            "the nearest name is '" + pipeline::nearest_name(name, known) + "'");
}

}  // namespace

int KinematicTree::link(const std::string& name) const {
  return index_of("link", name, links);
}
int KinematicTree::dof(const std::string& name) const {
  return index_of("joint", name, dof_names);
}

void forward_kinematics(const KinematicTree& tree, const Eigen::VectorXd& q, std::vector<Pose>& X_HL) {
  X_HL.resize(tree.links.size());
  X_HL[0] = Pose::Identity();
  for (const Joint& joint : tree.joints) {
    Pose& X_HC = X_HL[joint.child_link];
    X_HC = X_HL[joint.parent_link] * joint.X_PJ;
    if (joint.type == Joint::Type::fixed) continue;
    const double value = joint.multiplier * q[joint.dof] + joint.offset_rad;
    if (joint.type == Joint::Type::revolute)
      X_HC.rotate(Eigen::AngleAxisd(value, joint.axis_J));
    else
      X_HC.translate(value * joint.axis_J);
  }
}

void point_jacobian(const KinematicTree& tree, const std::vector<Pose>& X_HL, int link, const Vec3& p_H,
                    Eigen::Ref<Eigen::Matrix3Xd> jacobian) {
  jacobian.setZero();
  while (link != 0) {
    const Joint& joint = tree.joints[link - 1];
    const Vec3 axis_H =
        X_HL[link].linear() * joint.axis_J;  // turning about the axis leaves the axis in place
    if (joint.type == Joint::Type::revolute)
      jacobian.col(joint.dof) += joint.multiplier * axis_H.cross(p_H - X_HL[link].translation());
    if (joint.type == Joint::Type::prismatic) jacobian.col(joint.dof) += joint.multiplier * axis_H;
    link = joint.parent_link;
  }
}

}  // namespace geocage::hands
