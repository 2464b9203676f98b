#include "motion/duration.h"

#include <random>

#include <Eigen/LU>
#include <gtest/gtest.h>

#include "motion/tasks/limits.h"
#include "motion/tasks/state.h"

namespace geocage::motion {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::VectorXd;

VectorXd one(double value) {
  return VectorXd::Constant(1, value);
}

IntegratorRates rates(double h, double Q1, double Q2, Hold hold) {
  return {h * MatrixXd::Identity(1, 1), VectorXd::Zero(1), Q1, Q2, hold};
}

// Thesis A.1; numbers of the closed forms, printed to six digits.
TEST(EndPrior, ClosedFormsOfTheDoubleIntegrator) {
  const auto euler = integrator_prior(Vector2d(0, 0), rates(0.7, 0.01, 0.02, Hold::euler), 50, 2).covariance;
  EXPECT_NEAR(euler(0, 0), 1.994784, 1e-6);
  EXPECT_NEAR(euler(0, 1), 1.467200, 1e-6);
  EXPECT_NEAR(euler(1, 1), 1.440000, 1e-6);
  const auto exact = integrator_prior(Vector2d(0, 0), rates(0.7, 0.01, 0.02, Hold::exact), 50, 2).covariance;
  EXPECT_NEAR(exact(0, 0), 1.938224, 1e-6);
  EXPECT_NEAR(exact(0, 1), 1.439200, 1e-6);
  EXPECT_NEAR(exact(1, 1), 1.440000, 1e-6);
}

// The closed form against the process run step by step, with masses and a constant force.
TEST(EndPrior, EqualsTheProcessStepByStep) {
  std::mt19937_64 random(1);
  std::normal_distribution<> normal;
  const int n = 3, K = 17;
  const double D = 1.3, tau = D / K, H = 0.6, noise = 0.03;
  const MatrixXd G = MatrixXd::NullaryExpr(n, n, [&] { return normal(random); });
  const MatrixXd mass = G * G.transpose() + MatrixXd::Identity(n, n);
  const VectorXd force = VectorXd::NullaryExpr(n, [&] { return normal(random); });
  const VectorXd x_0 = VectorXd::NullaryExpr(2 * n, [&] { return normal(random); });
  for (Hold hold : {Hold::exact, Hold::euler}) {
    Process step = pseudo_dynamic(n, tau, H, noise, hold);
    dynamic(
        n, tau, H,
        [&](const VectorXd&, const VectorXd&, MatrixXd& M, VectorXd& F) {
          M = mass;
          F = force;
        },
        hold)(0, x_0, step);
    const MatrixXd inverse = mass.inverse();
    const IntegratorRates r{inverse * inverse.transpose() / H, inverse * force, noise, noise, hold};
    const auto closed = integrator_prior(x_0, r, K, D), added = end_prior(step, x_0, K);
    EXPECT_LT((closed.mean - added.mean).norm(), 1e-12);
    EXPECT_LT((closed.covariance - added.covariance).norm(), 1e-12);
    // Central differences in D: third derivatives of a cubic, times 1e-8.
    const auto up = integrator_prior(x_0, r, K, D + 1e-4), down = integrator_prior(x_0, r, K, D - 1e-4);
    EXPECT_LT((closed.covariance_rate - (up.covariance - down.covariance) / 2e-4).norm(), 1e-6);
    EXPECT_LT((closed.mean_rate - (up.mean - down.mean) / 2e-4).norm(), 1e-6);
  }
}

TEST(EndPrior, ManyStepsAreTheIntegral) {
  const auto limit = integrator_prior(Vector2d(0, 0), rates(0.7, 0, 0, Hold::exact), 100000, 2).covariance;
  EXPECT_NEAR(limit(0, 0), 0.7 * 8 / 3, 1e-6);
  EXPECT_NEAR(limit(0, 1), 0.7 * 2, 1e-6);
  EXPECT_NEAR(limit(1, 1), 0.7 * 2, 1e-12);
}

TEST(FinalPosture, OneDimensionInClosedForm) {
  const double S = 0.8, rho = 30, y = 1.5, q_0 = 0.2;
  const auto found =
      final_posture(random_walk_prior(one(q_0), MatrixXd::Constant(1, 1, S), 1),
                    {state_task(one(y), {0, rho})}, 1, one(q_0), {.damping = 0, .max_step = 100});
  EXPECT_NEAR(found.mean[0], (q_0 / S + rho * y) / (1 / S + rho), 1e-12);
  EXPECT_NEAR(found.precision(0, 0), 1 / S + rho, 1e-12);
  const double variance = S + 1 / rho, r = y - q_0;
  EXPECT_NEAR(found.log_likelihood, -0.5 * (std::log(2 * M_PI * variance) + r * r / variance), 1e-12);
}

// The posterior of x_T with everything between integrated out is the last belief of the whole trajectory.
TEST(FinalPosture, IsTheLastBeliefOfTheTrajectory) {
  const int T = 20;
  const double tau = 0.1, noise = 1e-3;
  Problem problem{pseudo_dynamic(1, tau, 1, noise), T, Vector2d(0.1, -0.4), {}};
  problem.tasks.push_back(state_task(Vector2d(1, 0), final_precision(T, 200)));
  const auto motion =
      aico(problem, std::vector<VectorXd>(T + 1, problem.start), {.damping = 0, .max_step = 100});
  const auto prior = integrator_prior(problem.start, rates(1, noise, noise, Hold::exact), T, T * tau);
  const auto posture = final_posture(prior, problem.tasks, T, problem.start, {.damping = 0, .max_step = 100});
  EXPECT_LT((posture.mean - motion.mean.back()).norm(), 1e-9);
  EXPECT_LT((posture.precision.inverse() - motion.covariance.back()).norm(), 1e-9);
}

TEST(FinalPosture, TheLikelihoodsSlopeIsItsDerivative) {
  const auto at = [](double D) {
    return final_posture(integrator_prior(Vector2d(0.1, 0.5), rates(0.4, 0.01, 0.02, Hold::exact), 50, D),
                         {state_task(Vector2d(1.5, 0.1), {0, 20})}, 1, Vector2d(0, 0),
                         {.damping = 0, .max_step = 100});
  };
  for (double D : {0.5, 2.0, 6.0})
    EXPECT_NEAR(at(D).likelihood_rate, (at(D + 1e-4).log_likelihood - at(D - 1e-4).log_likelihood) / 2e-4,
                1e-5);
}

// Closed optima of thesis A.3: random walk, double integrator to a position, and to a position at rest. The
// last two are limits of many steps: K = 2000 is within 1e-3 of them.
TEST(Duration, ClosedOptima) {
  const double rho = 1e4;
  const auto walk =
      estimate_duration([](double D) { return random_walk_prior(one(0), MatrixXd::Constant(1, 1, 0.3), D); },
                        {state_task(one(1.5), {0, rho})}, 1, one(0));
  EXPECT_EQ(walk.outcome, DurationOutcome::inside);
  EXPECT_NEAR(walk.duration_s, 7.499667, 1e-4);
  EXPECT_NEAR(walk.posture.likelihood_rate, 0, 1e-6);

  const auto integrator = [](double D) {
    return integrator_prior(Vector2d(0, 0), rates(0.4, 0, 0, Hold::exact), 2000, D);
  };
  Task position{"position",
                [](int, const VectorXd& x, VectorXd& error, MatrixXd* J) {
                  error = VectorXd::Constant(1, x[0] - 1.5);
                  if (J) *J = (MatrixXd(1, 2) << 1, 0).finished();
                },
                {0, rho}};
  EXPECT_NEAR(estimate_duration(integrator, {position}, 1, Vector2d(0, 0)).duration_s, 2.564926, 1e-3);
  EXPECT_NEAR(
      estimate_duration(integrator, {state_task(Vector2d(1.5, 0), {0, rho})}, 1, Vector2d(0, 0)).duration_s,
      3.698984, 1e-3);
}

// m coordinates: w D + 1 / rho = |d|^2 / m.
TEST(Duration, ManyCoordinatesShareOne) {
  const VectorXd d = (VectorXd(3) << 1, -2, 0.5).finished();
  const auto found = estimate_duration(
      [](double D) { return random_walk_prior(VectorXd::Zero(3), 0.3 * MatrixXd::Identity(3, 3), D); },
      {state_task(d, {0, 50})}, 1, VectorXd::Zero(3));
  EXPECT_NEAR(found.duration_s, (d.squaredNorm() / 3 - 1.0 / 50) / 0.3, 1e-4);
}

TEST(Duration, ATargetAtTheStartWantsTheShortest) {
  const auto found =
      estimate_duration([](double D) { return random_walk_prior(one(0), MatrixXd::Constant(1, 1, 0.3), D); },
                        {state_task(one(0), {0, 1e4})}, 1, one(0));
  EXPECT_EQ(found.outcome, DurationOutcome::at_least);
}

Problem walk_in_steps(double step_s) {
  Problem problem{kinematic(MatrixXd::Constant(1, 1, 0.3 * step_s)), 5, one(0), {}};
  problem.tasks.push_back(state_task(one(1.5), final_precision(5, 1e4)));
  return problem;
}
const ContinuousProcess walk_process{MatrixXd::Zero(1, 1), VectorXd::Zero(1), MatrixXd::Constant(1, 1, 0.3)};

// One M step with A = 0: d = 2 U / (T + sqrt(T^2 + 8 U T c)), U = sum E (x_{t+1} - x_t)^2 / w.
TEST(AicoT, TheMStepInClosedForm) {
  const auto beliefs =
      aico(walk_in_steps(1), std::vector<VectorXd>(6, one(0)), {.damping = 0, .max_step = 100});
  double U = 0;
  for (int t = 0; t < 5; ++t)
    U += (std::pow(beliefs.mean[t + 1][0] - beliefs.mean[t][0], 2) + beliefs.covariance[t + 1](0, 0) +
          beliefs.covariance[t](0, 0) - 2 * beliefs.pair_covariance[t](0, 0)) /
         0.3;
  EXPECT_NEAR(best_step_s(beliefs, walk_process, 0), U / 5, 1e-12);
  EXPECT_NEAR(best_step_s(beliefs, walk_process, 0.2), 2 * U / (5 + std::sqrt(25 + 8 * U * 5 * 0.2)), 1e-12);
  // The increments of a random walk pinned at both ends: mean x_T / T, variance w d (1 - 1 / T) and a share
  // of the end's.
  EXPECT_NEAR(U / 5, 1.5 * 1.5 / 25 / 0.3 + (1 - 1.0 / 5), 1e-3);
}

// Its rounds climb the marginal likelihood, whose optimum is (d^2 - 1 / rho) / w; each takes a fifth of what
// is left.
TEST(AicoT, EndsAtTheMarginalLikelihoodsOptimum) {
  const auto found = aico_t(walk_in_steps, walk_process, 0.4, std::vector<VectorXd>(6, one(0)),
                            {.damping = 0, .max_step = 100});
  EXPECT_NEAR(5 * found.step_s, 7.499667, 1e-4);
  for (std::size_t i = 1; i < found.steps_s.size(); ++i)
    EXPECT_GE(found.steps_s[i], found.steps_s[i - 1] - 1e-9);
}

}  // namespace
}  // namespace geocage::motion
