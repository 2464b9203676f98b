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

int KinematicTree::moving_joints() const {
  return static_cast<int>(std::count_if(joints.begin(), joints.end(),
                                        [](const Joint& joint) { return joint.type != Joint::Type::fixed; }));
}
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

KinematicData::KinematicData(const KinematicTree& tree)
    : X_HL(tree.links.size(), Pose::Identity()), dofs(tree.dofs()) {
  link_jacobians.setZero(6, static_cast<Eigen::Index>(tree.links.size()) * dofs);
}

void link_jacobians(const KinematicTree& tree, KinematicData& data) {
  const Eigen::Index n = data.dofs;
  data.link_jacobians.leftCols(n).setZero();
  for (const Joint& joint : tree.joints) {
    const auto of_parent = data.link_jacobians.middleCols(joint.parent_link * n, n);
    auto of_child = data.link_jacobians.middleCols(joint.child_link * n, n);
    const Pose& X_HC = data.X_HL[joint.child_link];
    const Vec3 shift_H = X_HC.translation() - data.X_HL[joint.parent_link].translation();
    for (int i = 0; i < n; ++i) {
      const Vec3 w = of_parent.col(i).tail<3>();
      of_child.col(i) << of_parent.col(i).head<3>() + w.cross(shift_H), w;
    }
    if (joint.type == Joint::Type::fixed) continue;
    // The joint's axis runs through the child's origin, so turning moves no origin.
    const Vec3 rate_H = joint.multiplier * (X_HC.linear() * joint.axis_J);
    const int first_row = joint.type == Joint::Type::revolute ? 3 : 0;
    of_child.col(joint.dof).segment<3>(first_row) += rate_H;
  }
}

void frame_jacobian(const KinematicTree& tree, const std::vector<Pose>& X_HL, int link, const Vec3& p_H,
                    Eigen::Ref<FrameJacobian> jacobian) {
  jacobian.setZero();
  for (; link != 0; link = tree.joints[link - 1].parent_link) {
    const Joint& joint = tree.joints[link - 1];
    if (joint.type == Joint::Type::fixed) continue;
    // turning about the axis leaves the axis in place
    const Vec3 rate_H = joint.multiplier * (X_HL[link].linear() * joint.axis_J);
    auto column = jacobian.col(joint.dof);
    if (joint.type == Joint::Type::prismatic) {
      column.head<3>() += rate_H;
      continue;
    }
    column.head<3>() += rate_H.cross(p_H - X_HL[link].translation());
    column.tail<3>() += rate_H;
  }
}

void point_jacobian(const KinematicTree& tree, const std::vector<Pose>& X_HL, int link, const Vec3& p_H,
                    Eigen::Ref<Eigen::Matrix3Xd> jacobian) {
  jacobian.setZero();
  for (; link != 0; link = tree.joints[link - 1].parent_link) {
    const Joint& joint = tree.joints[link - 1];
    if (joint.type == Joint::Type::fixed) continue;
    const Vec3 rate_H = joint.multiplier * (X_HL[link].linear() * joint.axis_J);
    const bool slides = joint.type == Joint::Type::prismatic;
    jacobian.col(joint.dof) += slides ? rate_H : rate_H.cross(p_H - X_HL[link].translation());
  }
}

}  // namespace geocage::hands
