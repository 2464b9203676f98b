#pragma once
#include <BulletDynamics/ConstraintSolver/btSequentialImpulseConstraintSolver.h>
#include <BulletDynamics/Featherstone/btMultiBodyConstraintSolver.h>

namespace geocage::physics {

/// Bullet's solver with two corrections to the rows of each contact.
/// A round friction cone: Bullet clips the two friction impulses of a contact to the cone, but steps each by
/// its own effective mass; where these differ, sliding friction points away from the motion and a block slips
/// up to two degrees too early. Both directions take the smaller step here. A gentle way out: Bullet answers
/// a penetration d with the speed erp d / dt, 0.4 m/s for 2 mm, and keeps it as momentum. Grasps planned on a
/// noisy surface start that deep, so the speed is bounded here. And a torsion of up to torsional_m times its
/// normal force for each contact: Bullet's own rows stand at one point of a manifold alone, and forget the
/// outer torque, so that a held body creeps by what a step of it adds.
class ContactSolver final : public btMultiBodyConstraintSolver {
 public:
  ContactSolver(btScalar way_out_m_s, btScalar torsional_m)
      : way_out_m_s_(way_out_m_s), torsional_m_(torsional_m) {}

 protected:
  btScalar solveGroupCacheFriendlySetup(btCollisionObject** bodies, int body_count,
                                        btPersistentManifold** manifolds, int manifold_count,
                                        btTypedConstraint** constraints, int constraint_count,
                                        const btContactSolverInfo& info, btIDebugDraw* drawer) override;

 private:
  void round_cones();
  void bound_way_out(const btContactSolverInfo& info);
  void resist_torsion(btPersistentManifold* const* manifolds, const btContactSolverInfo& info);

  btScalar way_out_m_s_, torsional_m_;
};

/// Bullet's solver for one body among walls, with a gentle way out: a penetration d is undone by moving
/// (split impulse), at the speed min(erp d / dt, way_out_m_s). Unbounded, a body in several contacts at once
/// is pushed out of one wall through the next.
class CageSolver final : public btSequentialImpulseConstraintSolver {
 public:
  explicit CageSolver(btScalar way_out_m_s) : way_out_m_s_(way_out_m_s) {}

 protected:
  btScalar solveGroupCacheFriendlySetup(btCollisionObject** bodies, int body_count,
                                        btPersistentManifold** manifolds, int manifold_count,
                                        btTypedConstraint** constraints, int constraint_count,
                                        const btContactSolverInfo& info, btIDebugDraw* drawer) override;

 private:
  btScalar way_out_m_s_;
};

}  // namespace geocage::physics
