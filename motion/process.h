#pragma once
#include <functional>

#include <Eigen/Core>

namespace geocage::motion {

/// Linear-Gaussian motion x_{t+1} = A x_t + a + B u_t + noise(Q), u_t costs u' H u, with the control
/// integrated out: x_{t+1} = A x_t + a + w, w ~ N(0, W), W = Q + B H^-1 B' (thesis eq. 2.5). W must be
/// positive definite. B, H and Q serve the policy only; without B the control is the step itself: B = I, H =
/// W^-1, Q = 0.
struct Process {
  Eigen::MatrixXd A;
  Eigen::VectorXd a;
  Eigen::MatrixXd W;
  Eigen::MatrixXd B, H, Q;
  int dim() const { return static_cast<int>(a.size()); }
};

/// x = q: a random walk with covariance `W` a step.
Process kinematic(const Eigen::MatrixXd& W);

/// B of the double integrator with steps of tau: k tau^2 for positions, tau for velocities. k = 1/2 is the
/// exact zero-order hold; k = 1 is Euler with the new velocity.
enum class Hold { exact, euler };
double hold_factor(Hold hold);

/// x = (q, v) of n unit masses. Costs and noise are rates: H = tau H_rate, Q = tau Q_rate I.
/// Preconditions: positive rates and tau.
Process pseudo_dynamic(Eigen::Index n, double tau_s, double control_cost_rate, double noise_rate,
                       Hold hold = Hold::exact);

/// M(q) dv/dt = F(q, v) + u: fills the mass matrix, n x n and positive definite, and the other forces.
using Mechanics = std::function<void(const Eigen::VectorXd& q, const Eigen::VectorXd& v,
                                     Eigen::MatrixXd& mass, Eigen::VectorXd& force)>;
/// The process of step t at the state x; `step` comes with all its sizes.
using Model = std::function<void(int t, const Eigen::VectorXd& x, Process& step)>;

/// x = (q, v) of n joints with masses: as pseudo_dynamic, with B = (k tau^2, tau) M^-1 and a = B F frozen at
/// the state where a step begins (thesis 2.3). For Problem::model beside a `process` of pseudo_dynamic with
/// the same numbers, which gives A and the noise.
Model dynamic(int n, double tau_s, double control_cost_rate, const Mechanics& mechanics,
              Hold hold = Hold::exact);

}  // namespace geocage::motion
