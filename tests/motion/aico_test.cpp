#include "motion/aico.h"

#include <random>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <gtest/gtest.h>

#include "motion/tasks/limits.h"
#include "motion/tasks/state.h"

namespace geocage::motion {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

AicoParams undamped() {
  return {.damping = 0, .max_step = 100};
}

std::vector<VectorXd> rest(const Problem& problem) {
  return std::vector<VectorXd>(static_cast<std::size_t>(problem.horizon) + 1, problem.start);
}

MatrixXd random_matrix(std::mt19937_64& random, int rows, int columns) {
  std::normal_distribution<> normal;
  return MatrixXd::NullaryExpr(rows, columns, [&] { return normal(random); });
}

/// e = G x - y with a random G and y.
Task linear_task(std::mt19937_64& random, int rows, int n, std::vector<double> precision) {
  const MatrixXd G = random_matrix(random, rows, n);
  const VectorXd y = random_matrix(random, rows, 1);
  return {"linear",
          [G, y](int, const VectorXd& x, VectorXd& error, MatrixXd* J) {
            error = G * x - y;
            if (J) *J = G;
          },
          std::move(precision)};
}

/// The same optimum without messages: the normal equations of the whole trajectory x_1 .. x_T.
VectorXd dense_solution(const Problem& problem) {
  const int n = problem.dim(), T = problem.horizon;
  const Process& p = problem.process;
  const MatrixXd Winv = p.W.llt().solve(MatrixXd::Identity(n, n));
  MatrixXd H = MatrixXd::Zero(n * T, n * T);
  VectorXd g = VectorXd::Zero(n * T);
  for (int t = 0; t < T; ++t) {  // |x_{t+1} - A x_t - a|^2
    const auto next = static_cast<Eigen::Index>(n) * t, here = next - n;
    VectorXd known = p.a;
    if (t == 0) known += p.A * problem.start;
    H.block(next, next, n, n) += Winv;
    g.segment(next, n) += Winv * known;
    if (t > 0) {
      H.block(here, here, n, n) += p.A.transpose() * Winv * p.A;
      H.block(here, next, n, n) -= p.A.transpose() * Winv;
      H.block(next, here, n, n) -= Winv * p.A;
      g.segment(here, n) -= p.A.transpose() * Winv * known;
    }
    const Quadratic q = linearise(problem, t + 1, VectorXd::Zero(n));
    H.block(next, next, n, n) += q.R;
    g.segment(next, n) += q.r;
  }
  return H.ldlt().solve(g);
}

// Thesis 2.3, one dimension: x_T = rho y / (rho + 1 / (T w)), x_t = t / T x_T; variances of a pinned random
// walk.
TEST(Aico, RandomWalkToATargetInClosedForm) {
  Problem problem{kinematic(MatrixXd::Identity(1, 1)), 10, VectorXd::Zero(1), {}};
  problem.tasks.push_back(state_task(VectorXd::Ones(1), final_precision(10, 100)));
  const AicoResult result = aico(problem, rest(problem), undamped());
  EXPECT_EQ(result.outcome, AicoOutcome::converged);
  for (int t = 1; t <= 10; ++t) EXPECT_NEAR(result.mean[t][0], t / 10.0 * 100 / 100.1, 1e-12);
  EXPECT_NEAR(result.mean[5][0], 0.499500500, 1e-8);
  EXPECT_NEAR(result.covariance[5](0, 0), 2.502497503, 1e-8);
  EXPECT_NEAR(result.covariance[10](0, 0), 0.009990010, 1e-8);
}

struct Golden {
  Hold hold;
  double q5, v5, q10, v10, q20, v20;
};
class DoubleIntegrator : public testing::TestWithParam<Golden> {};

// Values cross-checked against the dense solution; limited to 1e-5 by the condition of W (about 1e7).
TEST_P(DoubleIntegrator, ReachesItsTargetAtRest) {
  Problem problem{pseudo_dynamic(1, 0.1, 1, 1e-6, GetParam().hold), 20, VectorXd::Zero(2), {}};
  problem.tasks.push_back(state_task(Eigen::Vector2d(1, 0), final_precision(20, 1e4)));
  const auto& g = GetParam();
  const auto mean = aico(problem, rest(problem), undamped()).mean;
  EXPECT_NEAR(mean[5][0], g.q5, 1e-5);
  EXPECT_NEAR(mean[5][1], g.v5, 1e-5);
  EXPECT_NEAR(mean[10][0], g.q10, 1e-5);
  EXPECT_NEAR(mean[10][1], g.v10, 1e-5);
  EXPECT_NEAR(mean[20][0], g.q20, 1e-5);
  EXPECT_NEAR(mean[20][1], g.v20, 1e-5);
}
INSTANTIATE_TEST_SUITE_P(Holds, DoubleIntegrator,
                         testing::Values(Golden{Hold::exact, 0.155977782, 0.563776114, 0.499887217,
                                                0.751726540, 0.999849670, 0.000150323},
                                         Golden{Hold::euler, 0.184164287, 0.563769294, 0.537467291,
                                                0.751718698, 0.999849672, 0.000157836}));

TEST(Aico, RandomLinearGaussianProblemsEqualTheDenseSolution) {
  std::mt19937_64 random(1);
  for (int n : {4, 6, 9, 13})
    for (int T : {15, 40, 100}) {
      const MatrixXd M = random_matrix(random, n, n);
      Problem problem{
          kinematic(M * M.transpose() / n + MatrixXd::Identity(n, n)), T, random_matrix(random, n, 1), {}};
      problem.process.a = random_matrix(random, n, 1) / 10;
      problem.process.A += random_matrix(random, n, n) / (10 * n);
      problem.tasks.push_back(linear_task(random, 2, n, constant_precision(T, 0.3)));
      problem.tasks.push_back(linear_task(random, n / 2, n, final_precision(T, 50)));
      const auto result = aico(problem, rest(problem), undamped());
      const VectorXd dense = dense_solution(problem);
      for (int t = 1; t <= T; ++t)
        EXPECT_LT((result.mean[t] - dense.segment(n * (t - 1), n)).lpNorm<Eigen::Infinity>(), 1e-7)
            << n << " " << T;
    }
}

TEST(Aico, RandomDynamicProblemsEqualTheDenseSolution) {
  std::mt19937_64 random(2);
  for (int n : {2, 4, 6}) {
    const int T = 30;
    Problem problem{pseudo_dynamic(n, 0.1, 1, 1e-2), T, random_matrix(random, 2 * n, 1), {}};
    problem.tasks.push_back(linear_task(random, n, 2 * n, constant_precision(T, 0.5)));
    problem.tasks.push_back(linear_task(random, 2, 2 * n, final_precision(T, 100)));
    const auto result = aico(problem, rest(problem), undamped());
    const VectorXd dense = dense_solution(problem);
    for (int t = 1; t <= T; ++t)
      EXPECT_LT((result.mean[t] - dense.segment(2 * n * (t - 1), 2 * n)).lpNorm<Eigen::Infinity>(), 1e-7);
  }
}

/// A planar arm of three unit links that reaches for a point: nonlinear.
Problem reaching_arm(int T) {
  Problem problem{kinematic(0.02 * MatrixXd::Identity(3, 3)), T, Eigen::Vector3d(0.3, 0.4, 0.5), {}};
  const Eigen::Vector2d target(-1, 1.5);
  problem.tasks.push_back({"tip",
                           [target](int, const VectorXd& q, VectorXd& error, MatrixXd* J) {
                             error = -target;
                             if (J) *J = MatrixXd::Zero(2, 3);
                             double angle = 0;
                             for (int i = 0; i < 3; ++i) {
                               angle += q[i];
                               error += Eigen::Vector2d(std::cos(angle), std::sin(angle));
                               if (J)
                                 J->leftCols(i + 1).colwise() +=
                                     Eigen::Vector2d(-std::sin(angle), std::cos(angle));
                             }
                           },
                           final_precision(T, 1e3)});
  return problem;
}

TEST(Aico, CostsNeverRiseAndTheTaskIsReached) {
  for (bool proximal : {false, true}) {
    const Problem problem = reaching_arm(30);
    AicoParams params;
    params.proximal = proximal;
    const AicoResult result = aico(problem, rest(problem), params);
    EXPECT_EQ(result.outcome, AicoOutcome::converged);
    for (std::size_t i = 1; i < result.costs.size(); ++i) EXPECT_LE(result.costs[i], result.costs[i - 1]);
    EXPECT_EQ(result.costs.back(), total_cost(problem, result.mean));
    EXPECT_EQ(result.costs.size(), static_cast<std::size_t>(result.accepted) + 1);
    VectorXd error;
    problem.tasks[0].evaluate(30, result.mean.back(), error, nullptr);
    // The prior pulls with a share of about (1 / (T w)) / rho = 1.7e-3 of the way.
    EXPECT_LT(error.norm(), 0.01);
  }
}

TEST(Aico, TheFirstSliceIsClampedAndBeliefsAreProper) {
  const Problem problem = reaching_arm(20);
  const AicoResult result = aico(problem, rest(problem), {});
  EXPECT_TRUE((result.mean[0].array() == problem.start.array()).all());
  for (int t = 1; t <= 20; ++t)
    EXPECT_GT(Eigen::SelfAdjointEigenSolver<MatrixXd>(result.covariance[t]).eigenvalues().minCoeff(), 0) << t;
}

TEST(Aico, AWarmStartIsNeverMadeWorse) {
  const Problem problem = reaching_arm(30);
  const AicoResult cold = aico(problem, rest(problem), {});
  const AicoResult warm = aico(problem, cold.mean, {});
  EXPECT_LE(warm.costs.back(), cold.costs.back());
}

TEST(Tasks, LimitsPushOnlyBeyondThem) {
  const Task task = limits_task(Eigen::Vector2d(-1, -1), Eigen::Vector2d(1, 1), constant_precision(1, 1));
  VectorXd error;
  MatrixXd J;
  task.evaluate(0, Eigen::Vector2d(1.5, 0), error, &J);
  EXPECT_EQ(error, Eigen::Vector2d(0.5, 0));
  EXPECT_EQ(J, (MatrixXd(2, 2) << 1, 0, 0, 0).finished());
  task.evaluate(0, Eigen::Vector2d(0, -3), error, nullptr);
  EXPECT_EQ(error, Eigen::Vector2d(0, -2));
}

TEST(Process, DoubleIntegratorByHand) {
  const Process p = pseudo_dynamic(1, 0.5, 2, 0.1);
  EXPECT_EQ(p.A, (MatrixXd(2, 2) << 1, 0.5, 0, 1).finished());
  // B = (tau^2 / 2, tau), H = tau H_rate = 1, Q = tau Q_rate = 0.05.
  EXPECT_LT((p.W - (MatrixXd(2, 2) << 0.05 + 0.015625, 0.0625, 0.0625, 0.05 + 0.25).finished()).norm(),
            1e-15);
}

}  // namespace
}  // namespace geocage::motion
