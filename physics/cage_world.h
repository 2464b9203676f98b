#pragma once
#include <cstdint>
#include <memory>
#include <vector>

#include "physics/protocols.h"
#include "physics/world.h"
#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>
#include <BulletCollision/CollisionDispatch/btCollisionDispatcher.h>
#include <BulletCollision/CollisionDispatch/btDefaultCollisionConfiguration.h>
#include <BulletCollision/CollisionDispatch/btSimulationIslandManager.h>
#include <BulletDynamics/Dynamics/btDiscreteDynamicsWorld.h>

namespace geocage::physics {

/// One object among capsules that never move, without friction or gravity: a cage is a property of the closed
/// shape. World axes W are those of O at the start, unless X_WO says otherwise.
class CageWorld {
 public:
  /// `radius_m`: of the object about its centre of mass.
  CageWorld(const CageEngine& engine, const ObjectBody& object, double radius_m,
            const std::vector<hands::PlacedCapsule>& hand_W, const geometry::Pose& X_WO, std::uint64_t seed);
  CageWorld(const CageWorld&) = delete;

  /// dt under this force at the centre of mass and this torque; returns in how many steps.
  int step(const geometry::Vec3& force_W_n, const geometry::Vec3& torque_W_nm);

  geometry::Pose X_WB() const;
  geometry::Vec3 velocity_m_s() const;
  geometry::Vec3 spin_rad_s() const;
  double penetration_m() const {
    return penetration_m_;
  }  ///< deepest contact within the last dt, 0 when free

 private:
  double radius_m_, penetration_m_ = 0;
  CageEngine engine_;
  FieldShape shape_;
  btRigidBody object_;
  std::vector<std::unique_ptr<btCapsuleShapeZ>> capsules_;
  btCompoundShape hand_shape_;
  btCollisionObject hand_;
  btDefaultCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_;
  LockedHandAlgorithm::Create locked_hand_;
  btDbvtBroadphase broadphase_;
  CageSolver solver_;
  btDiscreteDynamicsWorld world_;  // last: its end touches all of the above
};

}  // namespace geocage::physics
