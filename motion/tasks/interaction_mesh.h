#pragma once
#include "motion/problem.h"
#include "motion/tasks/chain.h"

namespace geocage::motion {

/// Laplace coordinates of the nodes p_1 .. p_M, those of the moving chain first, then the fixed ones (Ho et
/// al. 2010; thesis 2.2): L_j = p_j - sum_l c_jl p_l, c_jl = (w_jl / d_jl) / sum_k w_jk / d_jk, d_jl = |p_j -
/// p_l|: where each node lies among its neighbours, near ones first. `weights` is M x M, not negative; its
/// diagonal is not looked at; a row of zeros leaves its node out (L_j = p_j). Precondition: nodes with a
/// weight between them don't meet.
class InteractionMesh {
 public:
  InteractionMesh(MovingChain chain, topology::Polyline fixed, Eigen::MatrixXd weights);
  /// All neighbours count alike.
  InteractionMesh(const MovingChain& chain, const topology::Polyline& fixed, int moving_nodes);
  /// 3 M coordinates [m], and unless null their Jacobian. O(M^2 dim).
  void evaluate(const Eigen::VectorXd& x, Eigen::VectorXd& laplace_m, Eigen::MatrixXd* jacobian) const;

 private:
  MovingChain chain_;
  topology::Polyline fixed_;
  Eigen::MatrixXd weights_;
};

/// Keeps to a mesh's Laplace coordinates: 3 M errors.
Task interaction_mesh_task(const InteractionMesh& mesh, const TargetOf& laplace_m,
                           std::vector<double> precision);

}  // namespace geocage::motion
