#pragma once
#include <functional>
#include <string>
#include <vector>

#include <Eigen/Cholesky>

#include "motion/process.h"

namespace geocage::motion {

/// A task variable: e_t(x) = phi(x) - y*_t should be small. Its cost is precision[t] |e_t(x)|^2.
struct Task {
  std::string name;
  /// Fills `error`, and `jacobian` (errors x dim) unless null. May answer with no rows. The same number of
  /// rows every time spares allocations.
  std::function<void(int t, const Eigen::VectorXd& x, Eigen::VectorXd& error, Eigen::MatrixXd* jacobian)>
      evaluate;
  std::vector<double> precision;  ///< T + 1 entries; 0 switches the task off at a step
  /// Most rows are asleep: a row whose error is exactly 0 counts nothing, and its row of the Jacobian is not
  /// read.
  bool hinge = false;
};

/// Find x_1 .. x_T from x_0: least process and task cost, or the most likely motion under exp(-cost / 2).
struct Problem {
  Process process;
  int horizon = 0;  ///< T
  Eigen::VectorXd start;
  std::vector<Task> tasks;
  /// Where the process depends on the state: fills that of the step from slice t. `process` gives A, Q and
  /// sizes.
  Model model = nullptr;
  int dim() const { return process.dim(); }
};

/// Task cost x' R x - 2 r' x + const around x (Gauss-Newton): R = sum rho J'J, r = sum rho J'(J x - e).
struct Quadratic {
  Eigen::MatrixXd R;
  Eigen::VectorXd r;
};

/// Memory for the terms of one problem, which must outlive it: costs and linearisations without allocation,
/// once every task has answered. Not for two threads at once.
class Terms {
 public:
  explicit Terms(const Problem& problem);
  /// Sets q, whose sizes must be right, and returns the task cost at x.
  double linearise(int t, const Eigen::VectorXd& x, Quadratic& q);
  double task_cost(int t, const Eigen::VectorXd& x);
  /// |x_{t+1} - A x_t - a|^2 in W^-1.
  double step_cost(int t, const Eigen::VectorXd& x, const Eigen::VectorXd& next);
  /// Of a whole trajectory x_0 .. x_T: tasks of steps 1 .. T and all steps.
  double total_cost(const std::vector<Eigen::VectorXd>& trajectory);
  /// The process of the step from slice t, frozen at x.
  const Process& process(int t, const Eigen::VectorXd& x);

 private:
  const Problem& problem_;
  struct Buffer {
    Eigen::VectorXd error, row, weighted;
    Eigen::MatrixXd J, scaled;
  };
  std::vector<Buffer> buffers_;
  Process frozen_;
  Eigen::LDLT<Eigen::MatrixXd> W_;
  Eigen::VectorXd step_, solved_;
};

// The same for those who ask once.
Quadratic linearise(const Problem& problem, int t, const Eigen::VectorXd& x);
double task_cost(const Problem& problem, int t, const Eigen::VectorXd& x);
double total_cost(const Problem& problem, const std::vector<Eigen::VectorXd>& trajectory);

/// What one task costs along a trajectory, and the norm of its error at the last step.
struct Residual {
  std::string task;
  double cost = 0, final_error = 0;
};
std::vector<Residual> residuals(const Problem& problem, const std::vector<Eigen::VectorXd>& trajectory);

/// The same precision at every step, and the same at the last one only.
std::vector<double> constant_precision(int horizon, double precision);
std::vector<double> final_precision(int horizon, double precision);

}  // namespace geocage::motion
