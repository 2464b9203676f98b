#include "motion/topology_space.h"

#include "motion/posture.h"

namespace geocage::motion {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

MatrixXd side_by_side(const MatrixXd& a, const MatrixXd& b) {
  MatrixXd both = MatrixXd::Zero(a.rows() + b.rows(), a.cols() + b.cols());
  both.topLeftCorner(a.rows(), a.cols()) = a;
  both.bottomRightCorner(b.rows(), b.cols()) = b;
  return both;
}

/// A task of z that sees only `count` coordinates from `first` on.
Task lifted(const Task& task, Eigen::Index first, Eigen::Index count) {
  Task all = task;
  all.evaluate = [=, evaluate = task.evaluate](int t, const VectorXd& z, VectorXd& error, MatrixXd* J) {
    MatrixXd part;
    evaluate(t, z.segment(first, count), error, J ? &part : nullptr);
    if (!J) return;
    J->setZero(error.size(), z.size());
    if (error.size()) J->middleCols(first, count) = part;
  };
  return all;
}

}  // namespace

Problem augmented(const Problem& problem, const TopologySpace& space) {
  const Eigen::Index n = problem.dim(), m = space.start.size();
  const MatrixXd I = MatrixXd::Identity(m, m), W_y = space.step_variance * I;
  const Process& p = problem.process;
  Problem both;
  both.horizon = problem.horizon;
  both.start.resize(n + m);
  both.start << problem.start, space.start;
  both.process.A = side_by_side(p.A, I);
  both.process.a = VectorXd::Zero(n + m);
  both.process.a.head(n) = p.a;
  both.process.W = side_by_side(p.W, W_y);
  if (p.B.size()) {  // y is driven by a control of its own
    both.process.B = side_by_side(p.B, I);
    both.process.H = side_by_side(p.H, I / space.step_variance);
    both.process.Q = side_by_side(p.Q, MatrixXd::Zero(m, m));
  }
  if (problem.model)
    both.model = [=, model = problem.model, own = p](int t, const VectorXd& z, Process& step) mutable {
      model(t, z.head(n), own);
      step.A.topLeftCorner(n, n) = own.A;
      step.a.head(n) = own.a;
      step.W.topLeftCorner(n, n) = own.W;
      step.B.topLeftCorner(own.B.rows(), own.B.cols()) = own.B;
    };
  for (const Task& task : problem.tasks) both.tasks.push_back(lifted(task, 0, n));
  for (const Task& task : space.tasks) both.tasks.push_back(lifted(task, n, m));
  const auto rung = [=, phi = space.phi.evaluate](int t, const VectorXd& z, VectorXd& error, MatrixXd* J) {
    MatrixXd by_x;
    VectorXd value;
    phi(t, z.head(n), value, J ? &by_x : nullptr);
    error = z.tail(m) - value;
    if (!J) return;
    J->resize(m, n + m);
    *J << -by_x, MatrixXd::Identity(m, m);
  };
  both.tasks.push_back({"topology coupling", rung, constant_precision(problem.horizon, space.coupling)});
  return both;
}

std::vector<double> bridge_precision(int horizon, double coupling, double step_variance,
                                     double final_precision) {
  std::vector<double> profile;
  for (int t = 0; t <= horizon; ++t) {
    const double s = double(t) / horizon;
    profile.push_back(1 / (1 / coupling + t * (1 - s) * step_variance + s * s / final_precision));
  }
  return profile;
}

HierarchicalPlan hierarchical(const Problem& problem, const Task& phi, double rho,
                              const std::function<VectorXd(const VectorXd&)>& wanted,
                              const AicoParams& params) {
  const int T = problem.horizon;
  HierarchicalPlan plan;
  plan.posture =
      final_posture(end_prior(problem.process, problem.start, T), problem.tasks, T, problem.start).mean;
  phi.evaluate(0, problem.start, plan.y_first, nullptr);
  VectorXd there;
  phi.evaluate(T, plan.posture, there, nullptr);
  plan.y_last = wanted(there);
  Problem with = problem;
  const auto towards = [evaluate = phi.evaluate, first = plan.y_first, last = plan.y_last, T](
                           int t, const VectorXd& x, VectorXd& error, MatrixXd* J) {
    evaluate(t, x, error, J);
    error -= first + double(t) / T * (last - first);
  };
  with.tasks.push_back({phi.name, towards, constant_precision(T, rho)});
  plan.motion = aico(with, std::vector<VectorXd>(static_cast<std::size_t>(T) + 1, problem.start), params);
  return plan;
}

}  // namespace geocage::motion
