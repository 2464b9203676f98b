#include "physics/contact_solver.h"

#include <algorithm>

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

}  // namespace geocage::physics
