#include "physics/cage_world.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "physics/bullet_eigen.h"

namespace geocage::physics {
namespace {

using geometry::Pose;
using geometry::Vec3;

btRigidBody::btRigidBodyConstructionInfo body_info(const ObjectBody& object, FieldShape& shape,
                                                   const Pose& X_WO) {
  btRigidBody::btRigidBodyConstructionInfo info(object.mass_kg, nullptr, &shape,
                                                bullet(object.inertia_kg_m2));
  info.m_startWorldTransform = bullet(Pose(X_WO * object.X_OB));
  info.m_friction = 0;
  return info;
}

btTransform capsule_pose(const hands::PlacedCapsule& capsule) {
  const Vec3 axis = capsule.b - capsule.a;
  Pose X = Pose::Identity();
  if (axis.norm() > 0) X.linear() = geometry::frame_from_z(axis.normalized());
  X.translation() = 0.5 * (capsule.a + capsule.b);
  return bullet(X);
}

}  // namespace

CageWorld::CageWorld(const CageEngine& engine, const ObjectBody& object, double radius_m,
                     const std::vector<hands::PlacedCapsule>& hand_W, const Pose& X_WO, std::uint64_t seed)
    : radius_m_(radius_m),
      engine_(engine),
      shape_(*object.field, object.X_OB.inverse(), engine.contact_m),
      object_(body_info(object, shape_, X_WO)),
      dispatcher_(&configuration_),
      solver_(engine.way_out_m_s),
      world_(&dispatcher_, &broadphase_, &solver_, &configuration_) {
  for (const auto& [first, second] : {std::pair{COMPOUND_SHAPE_PROXYTYPE, CUSTOM_CONCAVE_SHAPE_TYPE},
                                      std::pair{CUSTOM_CONCAVE_SHAPE_TYPE, COMPOUND_SHAPE_PROXYTYPE}})
    dispatcher_.registerCollisionCreateFunc(first, second, &locked_hand_);
  constexpr double converged_m_s = 1e-6;
  solver_.setRandSeed(static_cast<unsigned long>(seed));
  btContactSolverInfo& info = world_.getSolverInfo();
  info.m_numIterations = engine.iterations;
  info.m_leastSquaresResidualThreshold = converged_m_s * converged_m_s;
  info.m_solverMode = SOLVER_USE_WARMSTARTING | SOLVER_SIMD;
  info.m_splitImpulse = 1;
  info.m_splitImpulsePenetrationThreshold = 0;  // every depth is undone by moving, none by speed
  info.m_erp = info.m_erp2 = 0.2;
  info.m_globalCfm = 0;
  info.m_restitution = 0;
  world_.setGravity(btVector3(0, 0, 0));
  world_.getSimulationIslandManager()->setSplitIslands(false);  // one body moves

  for (const hands::PlacedCapsule& capsule : hand_W) {
    capsules_.push_back(std::make_unique<btCapsuleShapeZ>(capsule.radius_m, (capsule.b - capsule.a).norm()));
    hand_shape_.addChildShape(capsule_pose(capsule), capsules_.back().get());
  }
  hand_.setCollisionShape(&hand_shape_);
  hand_.setFriction(0);
  object_.setActivationState(DISABLE_DEACTIVATION);
  object_.setDamping(0, 0);
  if (engine.axis_locked) object_.setLinearFactor(btVector3(1, 1, 0));
  world_.addRigidBody(&object_, btBroadphaseProxy::DefaultFilter, btBroadphaseProxy::AllFilter);
  world_.addCollisionObject(&hand_, btBroadphaseProxy::StaticFilter, btBroadphaseProxy::DefaultFilter);
}

int CageWorld::step(const Vec3& force_W_n, const Vec3& torque_W_nm) {
  penetration_m_ = 0;
  // v' = a - v / tau ends a step at kept v + acting dt a, whatever its length.
  const double tau = engine_.damping_s;
  const auto kept = [&](double dt) { return tau > 0 ? std::exp(-dt / tau) : 1; };
  const auto acting = [&](double dt) { return tau > 0 ? (1 - kept(dt)) * tau / dt : 1; };
  const btVector3 force = bullet(force_W_n), torque = bullet(torque_W_nm);
  const auto fastest = [&](const btVector3& v, const btVector3& a) {
    const double dt = engine_.dt_s;
    return std::max(v.length(), (kept(dt) * v + acting(dt) * dt * a).length());
  };
  const double surface_m_s =
      fastest(object_.getLinearVelocity(), object_.getInvMass() * force) +
      radius_m_ * fastest(object_.getAngularVelocity(), object_.getInvInertiaTensorWorld() * torque);
  const double wanted = std::ceil(surface_m_s * engine_.dt_s / engine_.most_motion_m);
  const int parts = static_cast<int>(std::clamp<double>(wanted, 1, engine_.most_parts));
  const double dt = engine_.dt_s / parts;
  for (int part = 0; part < parts; ++part) {
    object_.setLinearVelocity(kept(dt) * object_.getLinearVelocity());
    object_.setAngularVelocity(kept(dt) * object_.getAngularVelocity());
    object_.applyCentralForce(acting(dt) * force);
    object_.applyTorque(acting(dt) * torque);
    shape_.set_contact_m(engine_.contact_m + std::min(surface_m_s * dt, engine_.most_motion_m));
    world_.stepSimulation(dt, 0);
    penetration_m_ = std::max(penetration_m_, deepest_contact_m(dispatcher_));
  }
  return parts;
}

Pose CageWorld::X_WB() const {
  return eigen(object_.getWorldTransform());
}
Vec3 CageWorld::velocity_m_s() const {
  return eigen(object_.getLinearVelocity());
}
Vec3 CageWorld::spin_rad_s() const {
  return eigen(object_.getAngularVelocity());
}

}  // namespace geocage::physics
