#pragma once
#include <functional>
#include <string>
#include <vector>

#include "motion/process.h"

namespace geocage::motion {

/// A task variable: e_t(x) = phi(x) - y*_t should be small. Its cost is precision[t] |e_t(x)|^2.
struct Task {
  std::string name;
  /// Fills `error`, and `jacobian` (errors x dim) unless null. May answer with no rows.
  std::function<void(int t, const Eigen::VectorXd& x, Eigen::VectorXd& error, Eigen::MatrixXd* jacobian)>
      evaluate;
  std::vector<double> precision;  ///< T + 1 entries; 0 switches the task off at a step
};

/// Find x_1 .. x_T from x_0: least process and task cost, or the most likely motion under exp(-cost / 2).
struct Problem {
  Process process;
  int horizon = 0;  ///< T
  Eigen::VectorXd start;
  std::vector<Task> tasks;
  int dim() const { return process.dim(); }
};

/// Task cost x' R x - 2 r' x + const around x (Gauss-Newton): R = sum rho J'J, r = sum rho J'(J x - e).
struct Quadratic {
  Eigen::MatrixXd R;
  Eigen::VectorXd r;
};
Quadratic linearise(const Problem& problem, int t, const Eigen::VectorXd& x);

double task_cost(const Problem& problem, int t, const Eigen::VectorXd& x);
/// Of a whole trajectory x_0 .. x_T: tasks of steps 1 .. T, and |x_{t+1} - A x_t - a|^2 in W^-1.
double total_cost(const Problem& problem, const std::vector<Eigen::VectorXd>& trajectory);

/// The same precision at every step, and the same at the last one only.
std::vector<double> constant_precision(int horizon, double precision);
std::vector<double> final_precision(int horizon, double precision);

/// phi(x) = x, target `goal`.
Task state_task(const Eigen::VectorXd& goal, std::vector<double> precision);
/// e = how far each coordinate is beyond its limits; infinite limits are no limits.
Task limits_task(const Eigen::VectorXd& lower, const Eigen::VectorXd& upper, std::vector<double> precision);

}  // namespace geocage::motion
