#pragma once
#include <vector>

#include "hands/hand.h"
#include "motion/rotation.h"

namespace geocage::motion {

using geometry::Pose;

/// A body of links and capsules that moves at an object O: a hand that floats, or one on an arm that stands.
///
/// Floating: x = (u, w, q), X_OH = (p_goal + 0.1 m u, exp(w) R_goal), so that all coordinates are of the size
/// of an angle. Standing: x = q of all joints, the base H of the tree rests at X_OH.
class Mover {
 public:
  static constexpr double unit_m = 0.1;

  static Mover floating(const hands::Hand& hand, const Pose& goal_X_OH) { return {hand, goal_X_OH, 6}; }
  /// `body` is an arm with its hand (hands::on_arm). Both must outlive the mover.
  static Mover standing(const hands::Hand& body, const Pose& base_X_OH) { return {body, base_X_OH, 0}; }

  int base_dofs() const { return base_dofs_; }  ///< 6 or 0
  bool floats() const { return base_dofs_ > 0; }
  int dim() const { return base_dofs_ + hand_.tree.dofs(); }
  const hands::Hand& hand() const { return hand_; }
  Eigen::VectorXd state(const Pose& X_OH, const Eigen::VectorXd& q) const;
  Pose pose(const Eigen::VectorXd& x) const;
  auto joints(const Eigen::VectorXd& x) const { return x.tail(hand_.tree.dofs()); }
  /// Of every coordinate; infinite for those of a floating base.
  Eigen::VectorXd lower() const, upper() const;

  /// Balls on the capsules' axes, each inside its capsule, nearer to each other than their radius.
  struct Ball {
    int capsule, link;
    Vec3 p_L;
    double radius_m;
  };
  const std::vector<Ball>& balls() const { return balls_; }
  /// Balls of one link, one after the other in balls(), and a ball around them all.
  struct Group {
    std::size_t begin, end;
    Vec3 p_L;
    double radius_m;
  };
  const std::vector<Group>& groups() const { return groups_; }

  /// A body at one state. Filled again and again without allocation, and left as it is where the state is the
  /// same: tasks that share one place the body once.
  struct Placed {
    Eigen::VectorXd x, q;
    std::vector<Pose> X_HL, X_OL;
    Pose X_OH = Pose::Identity();
    Matrix3d turning = Matrix3d::Identity();  ///< left Jacobian of the base's rotation vector
  };
  /// Precondition: `placed` is asked of this mover only.
  void place(const Eigen::VectorXd& x, Placed& placed) const;

  /// row += g' dp_O/dx for the point fixed in `link` that is at p_O.
  template <class Row>
  void add_gradient(const Placed& placed, int link, const Vec3& p_O, const Vec3& g, Row&& row) const {
    if (floats()) {
      const Vec3 by_turn = placed.turning.transpose() * (p_O - placed.X_OH.translation()).cross(g);
      for (int i = 0; i < 3; ++i) row[i] += unit_m * g[i];
      for (int i = 0; i < 3; ++i) row[3 + i] += by_turn[i];
    }
    for_joints(placed, link, [&](int column, bool slides, const Vec3& axis_O, const Vec3& at_O) {
      row[column] += slides ? axis_O.dot(g) : axis_O.cross(p_O - at_O).dot(g);
    });
  }
  /// row += g' (angular velocity of `link`) by dx/dt.
  template <class Row>
  void add_turning(const Placed& placed, int link, const Vec3& g, Row&& row) const {
    if (floats()) {
      const Vec3 by_turn = placed.turning.transpose() * g;
      for (int i = 0; i < 3; ++i) row[3 + i] += by_turn[i];
    }
    for_joints(placed, link, [&](int column, bool slides, const Vec3& axis_O, const Vec3&) {
      if (!slides) row[column] += axis_O.dot(g);
    });
  }

 private:
  Mover(const hands::Hand& hand, const Pose& X_OH, int base_dofs);
  /// Joints between link and base: column of x, whether it slides, axis times multiplier, a point of the
  /// axis.
  template <class Function>
  void for_joints(const Placed& placed, int link, Function f) const {
    for (; link != 0; link = hand_.tree.joints[static_cast<std::size_t>(link) - 1].parent_link) {
      const hands::Joint& joint = hand_.tree.joints[static_cast<std::size_t>(link) - 1];
      if (joint.type == hands::Joint::Type::fixed) continue;
      const Pose& X_OL = placed.X_OL[static_cast<std::size_t>(link)];
      f(base_dofs_ + joint.dof, joint.type == hands::Joint::Type::prismatic,
        Vec3(joint.multiplier * (X_OL.linear() * joint.axis_J)), Vec3(X_OL.translation()));
    }
  }

  const hands::Hand& hand_;
  Pose goal_;  ///< of the floating base, or where the base stands
  int base_dofs_;
  std::vector<Ball> balls_;
  std::vector<Group> groups_;
};

}  // namespace geocage::motion
