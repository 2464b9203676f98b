#include "physics/contact_solver.h"

#include <algorithm>

#include <BulletCollision/NarrowPhaseCollision/btPersistentManifold.h>

namespace geocage::physics {
namespace {

void step_by(btMultiBodySolverConstraint& row, btScalar effective_mass) {
  row.m_rhs *= effective_mass / row.m_jacDiagABInv;
  row.m_jacDiagABInv = effective_mass;
}

}  // namespace

btScalar ContactSolver::solveGroupCacheFriendlySetup(btCollisionObject** bodies, int body_count,
                                                     btPersistentManifold** manifolds, int manifold_count,
                                                     btTypedConstraint** constraints, int constraint_count,
                                                     const btContactSolverInfo& info, btIDebugDraw* drawer) {
  const btScalar residual = btMultiBodyConstraintSolver::solveGroupCacheFriendlySetup(
      bodies, body_count, manifolds, manifold_count, constraints, constraint_count, info, drawer);
  round_cones();
  bound_way_out(info);
  if (torsional_m_ > 0) resist_torsion(manifolds, info);
  return residual;
}

btScalar CageSolver::solveGroupCacheFriendlySetup(btCollisionObject** bodies, int body_count,
                                                  btPersistentManifold** manifolds, int manifold_count,
                                                  btTypedConstraint** constraints, int constraint_count,
                                                  const btContactSolverInfo& info, btIDebugDraw* drawer) {
  const btScalar residual = btSequentialImpulseConstraintSolver::solveGroupCacheFriendlySetup(
      bodies, body_count, manifolds, manifold_count, constraints, constraint_count, info, drawer);
  for (int i = 0; i < m_tmpSolverContactConstraintPool.size(); ++i) {
    btSolverConstraint& row = m_tmpSolverContactConstraintPool[i];
    row.m_rhsPenetration = std::min(row.m_rhsPenetration, way_out_m_s_ * row.m_jacDiagABInv);
  }
  return residual;
}

void ContactSolver::round_cones() {
  auto& rows = m_multiBodyFrictionContactConstraints;
  for (int i = 0; i + 1 < rows.size(); i += 2) {
    const btScalar smaller = std::min(rows[i].m_jacDiagABInv, rows[i + 1].m_jacDiagABInv);
    step_by(rows[i], smaller);
    step_by(rows[i + 1], smaller);
  }
}

void ContactSolver::bound_way_out(const btContactSolverInfo& info) {
  auto& rows = m_multiBodyNormalContactConstraints;
  for (int i = 0; i < rows.size(); ++i) {
    const auto& contact = *static_cast<const btManifoldPoint*>(rows[i].m_originalContactPoint);
    const btScalar asked = -contact.getDistance() * info.m_erp2 / info.m_timeStep;
    rows[i].m_rhs -= std::max(asked - way_out_m_s_, btScalar(0)) * rows[i].m_jacDiagABInv;
  }
}

// Rows of contacts are in the order of manifolds and of their points, some of which have none.
void ContactSolver::resist_torsion(btPersistentManifold* const* manifolds, const btContactSolverInfo& info) {
  int manifold = 0, point = 0;
  for (int i = 0; i < m_multiBodyNormalContactConstraints.size(); ++i) {
    const void* wanted = m_multiBodyNormalContactConstraints[i].m_originalContactPoint;
    while (point >= manifolds[manifold]->getNumContacts() ||
           &manifolds[manifold]->getContactPoint(point) != wanted)
      if (++point >= manifolds[manifold]->getNumContacts()) ++manifold, point = 0;
    btPersistentManifold* touching = manifolds[manifold];
    btManifoldPoint& contact = touching->getContactPoint(point);
    btMultiBodySolverConstraint& row = addMultiBodySpinningFrictionConstraint(
        contact.m_normalWorldOnB, touching, i, contact, torsional_m_,
        const_cast<btCollisionObject*>(touching->getBody0()),
        const_cast<btCollisionObject*>(touching->getBody1()), info.m_sor, info);
    const auto spun_up = [&](const btMultiBody* links, int body, const btVector3& axis) {
      return links ? btScalar(0) : axis.dot(m_tmpSolverBodyPool[body].m_externalTorqueImpulse);
    };
    row.m_rhs -=
        row.m_jacDiagABInv * (spun_up(row.m_multiBodyA, row.m_solverBodyIdA, row.m_relpos1CrossNormal) +
                              spun_up(row.m_multiBodyB, row.m_solverBodyIdB, row.m_relpos2CrossNormal));
  }
}

}  // namespace geocage::physics
