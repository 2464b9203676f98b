#pragma once
#include <functional>
#include <utility>
#include <vector>

#include "motion/posture.h"

namespace geocage::motion {

struct DurationRule {
  double least_s = 0.01, most_s = 100;
  int scan = 25;            ///< durations in equal ratios that are looked at first
  double precision = 1e-6;  ///< relative, of the answer
};

enum class DurationOutcome { inside, at_least, at_most };

struct DurationEstimate {
  DurationOutcome outcome = DurationOutcome::inside;  ///< or at an end of what the rule allows
  double duration_s = 0;
  FinalPosture posture;                               ///< re-estimated at that duration
  std::vector<std::pair<double, double>> likelihood;  ///< every (duration, log likelihood) that was looked at
};

/// How long a motion should take (thesis 4.2.3, A.2): the D that makes the targets of step `t` most likely,
/// posture re-estimated for each. Searched in log D: a scan, then golden section around the best. `prior(D)`
/// is x_T's.
DurationEstimate estimate_duration(const std::function<EndPrior(double)>& prior,
                                   const std::vector<Task>& tasks, int t, const Eigen::VectorXd& initial,
                                   const DurationRule& rule = {});

/// dx = (A x + a) dt + noise of covariance W dt.
struct ContinuousProcess {
  Eigen::MatrixXd A;
  Eigen::VectorXd a;
  Eigen::MatrixXd W;
};

/// M step of AICO-T (Rawlik et al. 2010): the step length that makes T steps of `process` most likely under
/// the beliefs, with a price of `time_cost` a second: d = 2 U / (N T + sqrt(N^2 T^2 + 4 U V)), U = sum
/// E|x_{t+1} - x_t|^2, V = sum E|A x_t + a|^2 + 2 T time_cost, both in W^-1, N the dimension. Precondition: W
/// positive definite.
double best_step_s(const AicoResult& beliefs, const ContinuousProcess& process, double time_cost);

struct AicoTResult {
  double step_s = 0;
  AicoResult motion;
  std::vector<double> steps_s;  ///< of every round, the first guess first
};

/// AICO-T: AICO with steps of d, then best_step_s, `rounds` times or until d changes by less than
/// `precision`, relatively. `problem_of(d)` is the problem in steps of d. Where noise is tiny the beliefs
/// hold on to the d they come from and rounds are many: prefer estimate_duration.
AicoTResult aico_t(const std::function<Problem(double step_s)>& problem_of, const ContinuousProcess& process,
                   double first_step_s, const std::vector<Eigen::VectorXd>& initial, const AicoParams& params,
                   double time_cost = 0, int rounds = 100, double precision = 1e-8);

}  // namespace geocage::motion
