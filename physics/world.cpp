#include "physics/world.h"

#include <algorithm>
#include <cmath>

#include "physics/bullet_eigen.h"
#include <Eigen/Eigenvalues>

#include "pipeline/error.h"

namespace geocage::physics {
namespace {

using geometry::Pose;
using geometry::Vec3;

btRigidBody::btRigidBodyConstructionInfo body_info(const ObjectBody& object, FieldShape& shape,
                                                   const Pose& X_WO, double friction) {
  btRigidBody::btRigidBodyConstructionInfo info(object.mass_kg, nullptr, &shape,
                                                bullet(object.inertia_kg_m2));
  info.m_startWorldTransform = bullet(Pose(X_WO * object.X_OB));
  info.m_friction = std::sqrt(friction);
  return info;
}

/// Without friction there is none.
double torsional_m(const Engine& engine, const hands::Hand& hand) {
  return engine.friction > 0 ? engine.torsional_m.value_or(engine.friction * hand.torsion_m) : 0;
}

void set_solver(btContactSolverInfo& info, const Engine& engine) {
  info.m_numIterations = engine.iterations;
  // Two friction directions with Bullet's cone: one direction slips far too early, the pyramid holds too
  // long.
  info.m_solverMode = SOLVER_USE_WARMSTARTING | SOLVER_SIMD | SOLVER_USE_2_FRICTION_DIRECTIONS;
  info.m_splitImpulse = 1;
  info.m_erp = info.m_erp2 = 0.2;
  info.m_globalCfm = 0;
  info.m_restitution = 0;
  info.m_warmstartingFactor = 0.85;
}

}  // namespace

ObjectBody solid_body(const geometry::TriangleMesh& mesh, const geometry::SignedDistanceField& field,
                      double mass_kg, std::optional<double> density_kg_m3) {
  const geometry::MassProperties solid = geometry::mass_properties(mesh);
  if (!(solid.volume_m3 > 0))
    throw pipeline::UserError(pipeline::Fault::geometry, "evaluate", "the object's mesh encloses no volume",
                              "give a closed mesh whose triangles face outward");
  if (density_kg_m3) mass_kg = *density_kg_m3 * solid.volume_m3;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> principal(solid.inertia);
  ObjectBody body{&field, mass_kg, Pose::Identity(), principal.eigenvalues() * mass_kg / solid.volume_m3};
  body.X_OB.linear() = principal.eigenvectors();
  if (body.X_OB.linear().determinant() < 0) body.X_OB.linear().col(2) *= -1;
  body.X_OB.translation() = solid.center;
  return body;
}

double gyration_m(const ObjectBody& object) {
  return std::sqrt(object.inertia_kg_m2.mean() / object.mass_kg);
}

World::World(const Engine& engine, const ObjectBody& object, const hands::Hand& hand, const Pose& X_WH,
             const Eigen::VectorXd& q, std::uint64_t seed, const Pose& X_WO)
    : engine_(engine),
      shape_(*object.field, object.X_OB.inverse(), engine.contact_m),
      object_(body_info(object, shape_, X_WO, engine.friction)),
      hand_(hand, X_WH, q, engine),
      dispatcher_(&configuration_),
      solver_(engine.way_out_m_s, torsional_m(engine, hand)),
      world_(&dispatcher_, &broadphase_, &solver_, &configuration_) {
  dispatcher_.registerCollisionCreateFunc(CAPSULE_SHAPE_PROXYTYPE, CUSTOM_CONCAVE_SHAPE_TYPE,
                                          &capsule_field_);
  solver_.setRandSeed(static_cast<unsigned long>(seed));
  set_solver(world_.getSolverInfo(), engine);
  world_.setGravity(btVector3(0, 0, 0));

  object_.setActivationState(DISABLE_DEACTIVATION);
  object_.setDamping(0, 0);
  world_.addRigidBody(&object_, btBroadphaseProxy::DefaultFilter, btBroadphaseProxy::AllFilter);
  hand_.enter(world_);
}

void World::hold(const Eigen::VectorXd& q_target, const Grip& grip) {
  hand_.hold(world_, q_target, grip, engine_.dt_s);
}

void World::set_gravity(const Vec3& gravity_W_m_s2) {
  world_.setGravity(bullet(gravity_W_m_s2));
}

void World::step(const Vec3& force_W_n, const Vec3& torque_W_nm) {
  object_.applyCentralForce(bullet(force_W_n));
  object_.applyTorque(bullet(torque_W_nm));
  world_.stepSimulation(engine_.dt_s, 0);
  const double slow = std::exp(-engine_.linear_damping_1ps * engine_.dt_s);
  const double calm = std::exp(-engine_.angular_damping_1ps * engine_.dt_s);
  if (slow < 1) object_.setLinearVelocity(slow * object_.getLinearVelocity());
  if (calm < 1) object_.setAngularVelocity(calm * object_.getAngularVelocity());
}

Pose World::X_WB() const {
  return eigen(object_.getWorldTransform());
}
Vec3 World::velocity_m_s() const {
  return eigen(object_.getLinearVelocity());
}
Vec3 World::spin_rad_s() const {
  return eigen(object_.getAngularVelocity());
}

bool World::touching() const {
  constexpr double touching_m = 1e-4;
  const btDispatcher& dispatcher = dispatcher_;
  for (int i = 0; i < dispatcher.getNumManifolds(); ++i) {
    const btPersistentManifold* manifold = dispatcher_.getManifoldByIndexInternal(i);
    for (int j = 0; j < manifold->getNumContacts(); ++j)
      if (manifold->getContactPoint(j).getDistance() < touching_m) return true;
  }
  return false;
}

double World::penetration_m() const {
  return deepest_contact_m(dispatcher_);
}

double deepest_contact_m(const btCollisionDispatcher& dispatcher) {
  double deepest = 0;
  const btDispatcher& base = dispatcher;
  for (int i = 0; i < base.getNumManifolds(); ++i) {
    const btPersistentManifold* manifold = dispatcher.getManifoldByIndexInternal(i);
    for (int j = 0; j < manifold->getNumContacts(); ++j)
      deepest = std::max(deepest, -manifold->getContactPoint(j).getDistance());
  }
  return deepest;
}

}  // namespace geocage::physics
