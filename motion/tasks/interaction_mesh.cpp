#include "motion/tasks/interaction_mesh.h"

namespace geocage::motion {

using Eigen::MatrixXd;
using Eigen::VectorXd;

InteractionMesh::InteractionMesh(MovingChain chain, topology::Polyline fixed, MatrixXd weights)
    : chain_(std::move(chain)), fixed_(std::move(fixed)), weights_(std::move(weights)) {}

InteractionMesh::InteractionMesh(const MovingChain& chain, const topology::Polyline& fixed, int moving_nodes)
    : InteractionMesh(chain, fixed,
                      MatrixXd::Ones(moving_nodes + static_cast<Eigen::Index>(fixed.size()),
                                     moving_nodes + static_cast<Eigen::Index>(fixed.size()))) {}

void InteractionMesh::evaluate(const VectorXd& x, VectorXd& laplace_m, MatrixXd* J) const {
  topology::Polyline p;
  MatrixXd by_state;
  chain_(x, p, J ? &by_state : nullptr);
  const auto moving = static_cast<Eigen::Index>(p.size());
  p.insert(p.end(), fixed_.begin(), fixed_.end());
  const auto M = static_cast<Eigen::Index>(p.size());
  laplace_m.resize(3 * M);
  if (J) J->setZero(3 * M, x.size());
  for (Eigen::Index j = 0; j < M; ++j) {
    const Vec3& p_j = p[static_cast<std::size_t>(j)];
    Vec3 mean = Vec3::Zero();
    double sum = 0;
    for (Eigen::Index l = 0; l < M; ++l) {
      if (l == j || weights_(j, l) == 0) continue;
      const Vec3& p_l = p[static_cast<std::size_t>(l)];
      const double a = weights_(j, l) / (p_j - p_l).norm();
      mean += a * p_l;
      sum += a;
    }
    if (sum > 0) mean /= sum;
    laplace_m.segment<3>(3 * j) = p_j - mean;
    if (!J) continue;
    auto rows = J->middleRows(3 * j, 3);
    if (j < moving) rows += by_state.middleRows(3 * j, 3);
    for (Eigen::Index l = 0; l < M; ++l) {
      if (l == j || weights_(j, l) == 0) continue;
      // dL_j = dp_j - sum_l c_l dp_l - sum_l (p_l - mean) da_l / sum, da_l = -a_l / d_l dd_l.
      const Vec3& p_l = p[static_cast<std::size_t>(l)];
      const double d = (p_j - p_l).norm(), a = weights_(j, l) / d;
      const Vec3 u = (p_j - p_l) / d;
      const Matrix3d by_difference = (p_l - mean) * u.transpose() * (a / d / sum);
      if (j < moving) rows += by_difference * by_state.middleRows(3 * j, 3);
      if (l < moving)
        rows -= (by_difference + a / sum * Matrix3d::Identity()) * by_state.middleRows(3 * l, 3);
    }
  }
}

Task interaction_mesh_task(const InteractionMesh& mesh, const TargetOf& laplace_m,
                           std::vector<double> precision) {
  return {"interaction mesh",
          [=](int t, const VectorXd& x, VectorXd& error, MatrixXd* J) {
            mesh.evaluate(x, error, J);
            error -= laplace_m(t);
          },
          std::move(precision)};
}

}  // namespace geocage::motion
