#pragma once
#include "motion/aico.h"

namespace geocage::motion {

/// A second chain of states y_0 .. y_T in topology space beside x: y_{t+1} = y_t + w, w ~ N(0, step_variance
/// I), bound to the motion by y_t ~ phi(x_t) with precision `coupling` (thesis 4.2.1, extended AICO).
struct TopologySpace {
  Task phi;               ///< phi(x) as its error; its own precision is not looked at
  Eigen::VectorXd start;  ///< y_0
  double step_variance = 1;
  double coupling = 1;
  std::vector<Task> tasks;  ///< of y
};

/// The problem of z = (x, y): one chain, exact where the parts are linear. coupling -> 0 decouples, coupling
/// -> infinity makes y = phi(x). O(T (dim + m)^3) a sweep.
Problem augmented(const Problem& problem, const TopologySpace& space);

/// What is left of y when it is integrated out slice by slice: a task phi(x_t) = (1 - t/T) y_0 + (t/T) y*_T
/// with the precision 1 / (1 / coupling + t (T - t) / T step_variance + (t / T)^2 / final_precision): the
/// Brownian bridge. Slices are taken as independent, which they are where step_variance is small.
std::vector<double> bridge_precision(int horizon, double coupling, double step_variance,
                                     double final_precision);

struct HierarchicalPlan {
  Eigen::VectorXd posture;          ///< x_T of final posture estimation without topology
  Eigen::VectorXd y_first, y_last;  ///< phi at the start, and what was asked for at the end
  AicoResult motion;
};

/// The thesis's pipeline: (i) a final posture from the tasks of step T; (ii) y there, turned into what is
/// wanted by `wanted`; (iii) AICO with the task phi = interpolation of y_0 and that, of precision `rho` at
/// every step.
HierarchicalPlan hierarchical(const Problem& problem, const Task& phi, double rho,
                              const std::function<Eigen::VectorXd(const Eigen::VectorXd& y_posture)>& wanted,
                              const AicoParams& params);

}  // namespace geocage::motion
