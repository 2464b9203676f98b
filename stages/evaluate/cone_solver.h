#pragma once
#include <BulletDynamics/Featherstone/btMultiBodyConstraintSolver.h>

namespace geocage::stages {

/// Bullet's solver with a friction cone that is round. Bullet clips the two friction impulses of a contact to
/// the cone, but steps each by its own effective mass; where these differ, sliding friction points away from
/// the motion and a block slips up to two degrees too early (tests/stages/evaluate). Both directions take the
/// smaller step here.
class ConeSolver final : public btMultiBodyConstraintSolver {
 protected:
  btScalar solveGroupCacheFriendlySetup(btCollisionObject** bodies, int body_count,
                                        btPersistentManifold** manifolds, int manifold_count,
                                        btTypedConstraint** constraints, int constraint_count,
                                        const btContactSolverInfo& info, btIDebugDraw* drawer) override;
};

}  // namespace geocage::stages
