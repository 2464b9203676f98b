#pragma once
#include <memory>
#include <vector>

#include "physics/protocols.h"
#include <BulletCollision/CollisionShapes/btCapsuleShape.h>
#include <BulletCollision/CollisionShapes/btCompoundShape.h>
#include <BulletDynamics/Featherstone/btMultiBody.h>
#include <BulletDynamics/Featherstone/btMultiBodyConstraint.h>
#include <BulletDynamics/Featherstone/btMultiBodyDynamicsWorld.h>
#include <BulletDynamics/Featherstone/btMultiBodyJointMotor.h>
#include <BulletDynamics/Featherstone/btMultiBodyLinkCollider.h>

#include "hands/hand.h"

namespace geocage::physics {

/// A hand as Bullet's articulated body with a fixed base: a link per joint of the tree, capsules as its
/// colliders, masses of solid capsules, joint limits, mimic joints geared to their leaders. Links collide
/// with the object only.
class HandBody {
 public:
  /// `q` holds the independent joints, within their limits.
  HandBody(const hands::Hand& hand, const hands::Pose& X_WH, const Eigen::VectorXd& q, const Engine& engine);

  void enter(btMultiBodyDynamicsWorld& world);
  /// Motors that drive the independent joints to `q_target` and hold them there; called
  /// again, they get new targets.
  void hold(btMultiBodyDynamicsWorld& world, const Eigen::VectorXd& q_target, const Grip& grip, double dt_s);

  Eigen::VectorXd joints() const;  ///< independent joints, in the order of the tree's dofs
  double fastest_joint() const;    ///< largest |joint speed|, rad/s or m/s
  hands::Pose X_WL(int link) const;

 private:
  void add_link(int joint, const Eigen::VectorXd& q, const Engine& engine);
  void add_collider(int link, double friction);
  void add_limits_and_gears();

  const hands::Hand& hand_;
  std::vector<hands::Vec3> com_L_;
  std::vector<std::unique_ptr<btCollisionShape>> shapes_;
  std::vector<std::unique_ptr<btMultiBodyLinkCollider>> colliders_;
  std::unique_ptr<btMultiBody> body_;
  std::vector<std::unique_ptr<btMultiBodyConstraint>> constraints_;
  std::vector<btMultiBodyJointMotor*> motors_;  ///< of the dofs, once they hold; owned above
};

}  // namespace geocage::physics
