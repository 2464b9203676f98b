#include "motion/process.h"

namespace geocage::motion {

using Eigen::MatrixXd;
using Eigen::VectorXd;

Process kinematic(const MatrixXd& W) {
  return {MatrixXd::Identity(W.rows(), W.rows()), VectorXd::Zero(W.rows()), W};
}

Process pseudo_dynamic(int n, double tau_s, double control_cost_rate, double noise_rate, Hold hold) {
  const double k = hold == Hold::exact ? 0.5 : 1;
  const MatrixXd I = MatrixXd::Identity(n, n);
  Process p;
  p.A = MatrixXd::Identity(2 * n, 2 * n);
  p.A.topRightCorner(n, n) = tau_s * I;
  p.a = VectorXd::Zero(2 * n);
  MatrixXd B(2 * n, n);
  B << k * tau_s * tau_s * I, tau_s * I;
  p.W =
      tau_s * noise_rate * MatrixXd::Identity(2 * n, 2 * n) + B * B.transpose() / (tau_s * control_cost_rate);
  return p;
}

}  // namespace geocage::motion
