#pragma once
#include <cstdint>
#include <optional>

#include "physics/contact_solver.h"
#include "physics/field_shape.h"
#include "physics/hand_body.h"
#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>
#include <BulletCollision/CollisionDispatch/btCollisionDispatcher.h>
#include <BulletCollision/CollisionDispatch/btDefaultCollisionConfiguration.h>
#include <BulletDynamics/Dynamics/btRigidBody.h>

namespace geocage::physics {

/// The object as a body: its field, its mass, and the frame B at the centre of mass along the principal axes.
struct ObjectBody {
  const geometry::SignedDistanceField* field = nullptr;
  double mass_kg = 0;
  geometry::Pose X_OB = geometry::Pose::Identity();
  geometry::Vec3 inertia_kg_m2 = geometry::Vec3::Ones();  ///< about the axes of B
};

/// Radius of gyration: the root of the mean principal moment over the mass.
double gyration_m(const ObjectBody& object);

/// Mass properties of the solid inside `mesh`, of even density: of this mass, or of this density where one is
/// given. UserError (geometry) where the volume is not positive.
ObjectBody solid_body(const geometry::TriangleMesh& mesh, const geometry::SignedDistanceField& field,
                      double mass_kg, std::optional<double> density_kg_m3 = {});

/// Depth of the deepest contact of all manifolds, 0 when there is none.
double deepest_contact_m(const btCollisionDispatcher& dispatcher);

/// One object and one hand without gravity, fresh for each trial. World axes W are those of O at the start.
/// Shares nothing with other worlds but constant data, so worlds may run side by side.
class World {
 public:
  World(const Engine& engine, const ObjectBody& object, const hands::Hand& hand, const geometry::Pose& X_WH,
        const Eigen::VectorXd& q, std::uint64_t seed,
        const geometry::Pose& X_WO = geometry::Pose::Identity());
  World(const World&) = delete;

  /// Motors on the hand's joints, from now on; called again, they get new targets.
  void hold(const Eigen::VectorXd& q_target, const Grip& grip);
  /// One step of dt with this force at the object's centre of mass and this torque.
  void step(const geometry::Vec3& force_W_n, const geometry::Vec3& torque_W_nm = geometry::Vec3::Zero());
  /// Acts on the object and on the links, from now on.
  void set_gravity(const geometry::Vec3& gravity_W_m_s2);

  geometry::Pose X_WB() const;
  geometry::Vec3 velocity_m_s() const;
  geometry::Vec3 spin_rad_s() const;
  double fastest_joint() const { return hand_.fastest_joint(); }
  const HandBody& hand() const { return hand_; }
  bool touching() const;         ///< some contact at the start of the last step had a gap below 0.1 mm
  double penetration_m() const;  ///< deepest contact at the start of the last step, 0 when free

 private:
  Engine engine_;
  FieldShape shape_;
  btRigidBody object_;
  HandBody hand_;
  btDefaultCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_;
  CapsuleFieldAlgorithm::Create capsule_field_;
  btDbvtBroadphase broadphase_;
  ContactSolver solver_;
  btMultiBodyDynamicsWorld world_;  // last: its end touches all of the above
};

}  // namespace geocage::physics
