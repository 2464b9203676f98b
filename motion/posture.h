#pragma once
#include "motion/gauss_newton.h"

namespace geocage::motion {

/// What the process alone says of x_T, and how that changes with the duration D [1/s].
struct EndPrior {
  Eigen::VectorXd mean;
  Eigen::MatrixXd covariance;
  Eigen::VectorXd mean_rate;
  Eigen::MatrixXd covariance_rate;
};

/// Of a random walk with `covariance_rate` [1/s]: N(q_0, D covariance_rate).
EndPrior random_walk_prior(const Eigen::VectorXd& q_0, const Eigen::MatrixXd& covariance_rate,
                           double duration_s);

/// Costs and noise of a double integrator, as rates.
struct IntegratorRates {
  Eigen::MatrixXd control_covariance;  ///< M^-1 H_rate^-1 M^-T, n x n; H_rate^-1 for unit masses
  Eigen::VectorXd acceleration;        ///< M^-1 F, held all the time; 0 for unit masses
  double position_noise = 0, velocity_noise = 0;
  Hold hold = Hold::exact;
};
/// Of x = (q, v) after `steps` equal steps in D: thesis A.1, exact for both holds.
EndPrior integrator_prior(const Eigen::VectorXd& x_0, const IntegratorRates& rates, int steps,
                          double duration_s);

/// The same for any constant process, added up step by step; no rates (they are 0). O(steps dim^3).
EndPrior end_prior(const Process& process, const Eigen::VectorXd& x_0, int steps);

struct FinalPosture {
  AicoOutcome outcome = AicoOutcome::converged;
  Eigen::VectorXd mean;        ///< most likely x_T
  Eigen::MatrixXd precision;   ///< of the belief: prior and tasks
  double log_likelihood = 0;   ///< of the tasks' targets given the prior, tasks linearised at `mean`
  double likelihood_rate = 0;  ///< its derivative by D [1/s], posture held
  std::vector<double> costs;   ///< never rise
};

/// Final posture estimation (thesis 4.2.2): the posterior of x_T from its prior and the tasks of step `t`,
/// all steps between integrated out; damped Gauss-Newton from `initial`. The likelihood is that of thesis A.2
/// in task space: log N(y* - phi + G x | G mean, P + G covariance G') with task rows G and variances P = 1 /
/// rho. Tasks of precision 0 at `t` don't count. Precondition: the prior's covariance is positive definite.
FinalPosture final_posture(const EndPrior& prior, const std::vector<Task>& tasks, int t,
                           const Eigen::VectorXd& initial, const GaussNewtonParams& params = {});

}  // namespace geocage::motion
