#pragma once
#include <Eigen/Core>

namespace geocage::motion {

/// Linear-Gaussian motion x_{t+1} = A x_t + a + w, w ~ N(0, W), with the control integrated out:
/// W = Q + B H^-1 B' (thesis eq. 2.5). W must be positive definite.
struct Process {
  Eigen::MatrixXd A;
  Eigen::VectorXd a;
  Eigen::MatrixXd W;
  int dim() const { return static_cast<int>(a.size()); }
};

/// x = q: a random walk with covariance `W` a step.
Process kinematic(const Eigen::MatrixXd& W);

/// B of the double integrator with steps of tau: k tau^2 for positions, tau for velocities. k = 1/2 is the
/// exact zero-order hold; k = 1 is Euler with the new velocity.
enum class Hold { exact, euler };

/// x = (q, v) of n unit masses. Costs and noise are rates: H = tau H_rate, Q = tau Q_rate I.
/// Preconditions: positive rates and tau.
Process pseudo_dynamic(int n, double tau_s, double control_cost_rate, double noise_rate,
                       Hold hold = Hold::exact);

}  // namespace geocage::motion
