#include "physics/hand_body.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "physics/bullet_eigen.h"
#include <BulletDynamics/Featherstone/btMultiBodyGearConstraint.h>
#include <BulletDynamics/Featherstone/btMultiBodyJointLimitConstraint.h>

namespace geocage::physics {
namespace {

using hands::Capsule;
using hands::Joint;
using hands::Vec3;

struct Inertia {
  double mass_kg = 0;
  Vec3 com_L = Vec3::Zero();
  Eigen::Matrix3d about_com = Eigen::Matrix3d::Zero();
};

/// Joints need an inertia even where a link has no capsule: 10 g within a ball of 1 cm.
const Inertia bare_link = {0.01, Vec3::Zero(), 0.4 * 0.01 * 1e-4 * Eigen::Matrix3d::Identity()};

/// A solid capsule: cylinder plus two half balls.
Inertia inertia_of(const Capsule& capsule, double density) {
  const Vec3 axis = capsule.b_L - capsule.a_L;
  const double length = axis.norm(), r = capsule.radius_m;
  const double cylinder = density * std::numbers::pi * r * r * length;
  const double ball = density * 4.0 / 3.0 * std::numbers::pi * r * r * r;
  const double along = cylinder * r * r / 2 + ball * 0.4 * r * r;
  const double across = cylinder * (length * length / 12 + r * r / 4) +
                        ball * (0.4 * r * r + length * length / 4 + 0.375 * length * r);
  const Vec3 u = axis.stableNormalized();
  return {cylinder + ball, 0.5 * (capsule.a_L + capsule.b_L),
          across * Eigen::Matrix3d::Identity() + (along - across) * u * u.transpose()};
}

/// Of all capsules of a link, overlaps counted twice.
Inertia inertia_of(const hands::Hand& hand, int link, double density) {
  std::vector<Inertia> parts;
  Inertia sum;
  for (const Capsule& capsule : hand.capsules)
    if (capsule.link == link) parts.push_back(inertia_of(capsule, density));
  if (parts.empty()) return bare_link;
  for (const Inertia& part : parts) sum.mass_kg += part.mass_kg, sum.com_L += part.mass_kg * part.com_L;
  sum.com_L /= sum.mass_kg;
  for (const Inertia& part : parts) {
    const Vec3 d = part.com_L - sum.com_L;
    sum.about_com +=
        part.about_com + part.mass_kg * (d.squaredNorm() * Eigen::Matrix3d::Identity() - d * d.transpose());
  }
  return sum;
}

btTransform capsule_frame(const Capsule& capsule, const Vec3& com_L) {
  const Vec3 axis = capsule.b_L - capsule.a_L;
  geometry::Pose X = geometry::Pose::Identity();
  if (axis.norm() > 0) X.linear() = geometry::frame_from_z(axis.normalized());
  X.translation() = 0.5 * (capsule.a_L + capsule.b_L) - com_L;
  return bullet(X);
}

/// The joint that moves as the independent joint `dof` itself does.
int leader(const hands::KinematicTree& tree, int dof) {
  const auto leads = [&](const Joint& joint) {
    return joint.type != Joint::Type::fixed && joint.name == tree.dof_names[dof];
  };
  return static_cast<int>(std::ranges::find_if(tree.joints, leads) - tree.joints.begin());
}

}  // namespace

// Bullet's link frame has the axes of L and its origin at the link's centre of mass; the base keeps its own
// origin. Bullet wants a diagonal inertia: the products of inertia in the axes of L are left out.
HandBody::HandBody(const hands::Hand& hand, const hands::Pose& X_WH, const Eigen::VectorXd& q,
                   const Engine& engine)
    : hand_(hand), com_L_(hand.tree.links.size(), Vec3::Zero()) {
  const bool fixed_base = true, can_sleep = false;
  body_ = std::make_unique<btMultiBody>(static_cast<int>(hand.tree.joints.size()), 0, btVector3(0, 0, 0),
                                        fixed_base, can_sleep);
  body_->setBaseWorldTransform(bullet(X_WH));
  for (int joint = 0; joint < static_cast<int>(hand.tree.joints.size()); ++joint) add_link(joint, q, engine);
  body_->finalizeMultiDof();
  body_->setLinearDamping(0);
  body_->setAngularDamping(0);
  body_->setHasSelfCollision(false);

  for (int link = 0; link < static_cast<int>(hand.tree.links.size()); ++link)
    add_collider(link, std::sqrt(engine.friction));
  btAlignedObjectArray<btQuaternion> rotations;
  btAlignedObjectArray<btVector3> places;
  body_->forwardKinematics(rotations, places);
  body_->updateCollisionObjectWorldTransforms(rotations, places);
  add_limits_and_gears();
}

void HandBody::add_link(int index, const Eigen::VectorXd& q, const Engine& engine) {
  const Joint& joint = hand_.tree.joints[index];
  const Inertia inertia = inertia_of(hand_, joint.child_link, engine.hand_density_kg_m3);
  com_L_[joint.child_link] = inertia.com_L;

  const btVector3 diagonal = bullet(Vec3(inertia.about_com.diagonal()));
  btQuaternion rot_parent_to_this;
  bullet(Eigen::Matrix3d(joint.X_PJ.linear().transpose())).getRotation(rot_parent_to_this);
  const btVector3 axis = bullet(joint.axis_J), com = bullet(inertia.com_L);
  const btVector3 pivot = bullet(Vec3(joint.X_PJ.translation() - com_L_[joint.parent_link]));
  const int parent = joint.parent_link - 1;  // the base is link -1
  switch (joint.type) {
    case Joint::Type::fixed:
      body_->setupFixed(index, inertia.mass_kg, diagonal, parent, rot_parent_to_this, pivot, com);
      return;
    case Joint::Type::revolute:
      body_->setupRevolute(index, inertia.mass_kg, diagonal, parent, rot_parent_to_this, axis, pivot, com,
                           true);
      break;
    case Joint::Type::prismatic:
      body_->setupPrismatic(index, inertia.mass_kg, diagonal, parent, rot_parent_to_this, axis, pivot, com,
                            true);
      break;
  }
  body_->setJointPos(index, joint.multiplier * q[joint.dof] + joint.offset_rad);
}

// A link without capsules gets an empty shape: Bullet finds the island of a link's motor by its collider.
void HandBody::add_collider(int link, double friction) {
  auto compound = std::make_unique<btCompoundShape>();
  for (const Capsule& capsule : hand_.capsules) {
    if (capsule.link != link) continue;
    auto part = std::make_unique<btCapsuleShapeZ>(capsule.radius_m, (capsule.b_L - capsule.a_L).norm());
    compound->addChildShape(capsule_frame(capsule, com_L_[link]), part.get());
    shapes_.push_back(std::move(part));
  }

  auto collider = std::make_unique<btMultiBodyLinkCollider>(body_.get(), link - 1);
  collider->setCollisionShape(compound.get());
  collider->setFriction(friction);
  collider->setActivationState(DISABLE_DEACTIVATION);
  if (link == 0)
    body_->setBaseCollider(collider.get());
  else
    body_->getLink(link - 1).m_collider = collider.get();
  shapes_.push_back(std::move(compound));
  colliders_.push_back(std::move(collider));
}

void HandBody::add_limits_and_gears() {
  constexpr double gear_impulse = 10;
  const auto& joints = hand_.tree.joints;
  for (int i = 0; i < static_cast<int>(joints.size()); ++i) {
    const Joint& joint = joints[i];
    if (joint.type == Joint::Type::fixed) continue;
    const int leads = leader(hand_.tree, joint.dof);
    if (i == leads) {
      constraints_.push_back(std::make_unique<btMultiBodyJointLimitConstraint>(
          body_.get(), i, joint.lower_rad, joint.upper_rad));
      continue;
    }
    auto gear = std::make_unique<btMultiBodyGearConstraint>(
        body_.get(), i, body_.get(), leads, btVector3(0, 0, 0), btVector3(0, 0, 0),
        btMatrix3x3::getIdentity(), btMatrix3x3::getIdentity());
    gear->setGearRatio(-joint.multiplier);
    gear->setRelativePositionTarget(joint.offset_rad);
    gear->setErp(1);
    gear->setMaxAppliedImpulse(gear_impulse);
    constraints_.push_back(std::move(gear));
  }
}

void HandBody::enter(btMultiBodyDynamicsWorld& world) {
  for (const auto& collider : colliders_)
    world.addCollisionObject(collider.get(), btBroadphaseProxy::KinematicFilter,
                             btBroadphaseProxy::DefaultFilter);
  world.addMultiBody(body_.get());
  for (const auto& constraint : constraints_) world.addMultiBodyConstraint(constraint.get());
}

void HandBody::hold(btMultiBodyDynamicsWorld& world, const Eigen::VectorXd& q_target, const Grip& grip,
                    double dt_s) {
  for (std::size_t dof = 0; dof < motors_.size(); ++dof)
    motors_[dof]->setPositionTarget(q_target[static_cast<Eigen::Index>(dof)], grip.gain_1ps * dt_s);
  if (!motors_.empty()) return;
  for (int dof = 0; dof < hand_.tree.dofs(); ++dof) {
    const int i = leader(hand_.tree, dof);
    const bool slides = hand_.tree.joints[i].type == Joint::Type::prismatic;
    const double own = hand_.tree.effort_limit_nm[dof],
                 limit = slides ? grip.force_limit_n : grip.torque_limit_nm;
    const double effort = own > 0 ? std::min(own, limit) : limit;
    auto motor = std::make_unique<btMultiBodyJointMotor>(body_.get(), i, 0, effort * dt_s);
    motor->setPositionTarget(q_target[dof], grip.gain_1ps * dt_s);  // Bullet's gain is the share of a step
    motor->setVelocityTarget(0, 1);
    const double own_speed = hand_.tree.velocity_limit_rad_s[dof],
                 speed = slides ? grip.speed_limit_m_s : grip.speed_limit_rad_s;
    motor->setRhsClamp(own_speed > 0 ? std::min(own_speed, speed) : speed);
    world.addMultiBodyConstraint(motor.get());
    motors_.push_back(motor.get());
    constraints_.push_back(std::move(motor));
  }
}

Eigen::VectorXd HandBody::joints() const {
  Eigen::VectorXd q(hand_.tree.dofs());
  for (int dof = 0; dof < hand_.tree.dofs(); ++dof) q[dof] = body_->getJointPos(leader(hand_.tree, dof));
  return q;
}

double HandBody::fastest_joint() const {
  double fastest = 0;
  for (int i = 0; i < body_->getNumLinks(); ++i)
    if (body_->getLink(i).m_dofCount > 0) fastest = std::max(fastest, std::abs(body_->getJointVel(i)));
  return fastest;
}

hands::Pose HandBody::X_WL(int link) const {
  const int i = link - 1;
  btMatrix3x3 R = btMatrix3x3::getIdentity();
  hands::Pose X;
  X.linear() = eigen(btTransform(body_->localFrameToWorld(i, R))).linear();
  X.translation() = eigen(body_->localPosToWorld(i, bullet(Vec3(-com_L_[link]))));
  return X;
}

}  // namespace geocage::physics
