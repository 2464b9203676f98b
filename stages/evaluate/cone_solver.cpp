#include "stages/evaluate/cone_solver.h"

#include <algorithm>

namespace geocage::stages {
namespace {

void step_by(btMultiBodySolverConstraint& row, btScalar effective_mass) {
  row.m_rhs *= effective_mass / row.m_jacDiagABInv;
  row.m_jacDiagABInv = effective_mass;
}

}  // namespace

btScalar ConeSolver::solveGroupCacheFriendlySetup(btCollisionObject** bodies, int body_count,
                                                  btPersistentManifold** manifolds, int manifold_count,
                                                  btTypedConstraint** constraints, int constraint_count,
                                                  const btContactSolverInfo& info, btIDebugDraw* drawer) {
  const btScalar residual = btMultiBodyConstraintSolver::solveGroupCacheFriendlySetup(
      bodies, body_count, manifolds, manifold_count, constraints, constraint_count, info, drawer);
  auto& rows = m_multiBodyFrictionContactConstraints;
  for (int i = 0; i + 1 < rows.size(); i += 2) {
    const btScalar smaller = std::min(rows[i].m_jacDiagABInv, rows[i + 1].m_jacDiagABInv);
    step_by(rows[i], smaller);
    step_by(rows[i + 1], smaller);
  }
  return residual;
}

}  // namespace geocage::stages
