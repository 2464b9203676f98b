#include "motion/process.h"

#include <memory>

#include <Eigen/Cholesky>

namespace geocage::motion {

using Eigen::MatrixXd;
using Eigen::VectorXd;

double hold_factor(Hold hold) {
  return hold == Hold::exact ? 0.5 : 1;
}

Process kinematic(const MatrixXd& W) {
  const auto n = W.rows();
  return {MatrixXd::Identity(n, n),
          VectorXd::Zero(n),
          W,
          MatrixXd::Identity(n, n),
          W.llt().solve(MatrixXd::Identity(n, n)),
          MatrixXd::Zero(n, n)};
}

Process pseudo_dynamic(Eigen::Index n, double tau_s, double control_cost_rate, double noise_rate, Hold hold) {
  const MatrixXd I = MatrixXd::Identity(n, n);
  Process p;
  p.A = MatrixXd::Identity(2 * n, 2 * n);
  p.A.topRightCorner(n, n) = tau_s * I;
  p.a = VectorXd::Zero(2 * n);
  p.B.resize(2 * n, n);
  p.B << hold_factor(hold) * tau_s * tau_s * I, tau_s * I;
  p.H = tau_s * control_cost_rate * I;
  p.Q = tau_s * noise_rate * MatrixXd::Identity(2 * n, 2 * n);
  p.W = p.Q + p.B * p.B.transpose() / (tau_s * control_cost_rate);
  return p;
}

Model dynamic(int n, double tau_s, double control_cost_rate, const Mechanics& mechanics, Hold hold) {
  struct Memory {
    MatrixXd mass, inverse;
    VectorXd q, v, force, acceleration;
    Eigen::LLT<MatrixXd> solver;
  };
  auto memory = std::make_shared<Memory>();  // of this model's one user: not for two threads
  memory->mass.setIdentity(n, n);
  memory->force.setZero(n);
  memory->solver = Eigen::LLT<MatrixXd>(n);
  const double k = hold_factor(hold);
  return [=](int, const VectorXd& x, Process& step) {
    Memory& m = *memory;
    m.q = x.head(n);
    m.v = x.tail(n);
    mechanics(m.q, m.v, m.mass, m.force);
    m.solver.compute(m.mass);
    m.acceleration = m.force;
    m.solver.solveInPlace(m.acceleration);
    m.inverse.setIdentity(n, n);
    m.solver.solveInPlace(m.inverse);
    step.B.topRows(n) = k * tau_s * tau_s * m.inverse;
    step.B.bottomRows(n) = tau_s * m.inverse;
    step.a.head(n) = k * tau_s * tau_s * m.acceleration;
    step.a.tail(n) = tau_s * m.acceleration;
    step.W = step.Q;
    step.W.noalias() += step.B * step.B.transpose() / (tau_s * control_cost_rate);
  };
}

}  // namespace geocage::motion
