// What an AICO search is beside its mean: modes of sweeping, where it stalls and why, policy, pair
// covariances, processes with masses, and that it allocates nothing. The counter replaces malloc, so
// sanitizers keep theirs.
#include <cstdlib>
#include <random>

#include <Eigen/LU>
#include <Eigen/SparseCholesky>
#include <gtest/gtest.h>

#include "motion/gauss_newton.h"
#include "motion/tasks/limits.h"
#include "motion/tasks/state.h"
#include "tests/allocations.h"

namespace geocage::motion {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using Path = std::vector<VectorXd>;

MatrixXd random_matrix(std::mt19937_64& random, Eigen::Index rows, Eigen::Index columns) {
  std::normal_distribution<> normal;
  return MatrixXd::NullaryExpr(rows, columns, [&] { return normal(random); });
}

Task linear_task(std::mt19937_64& random, int rows, int n, std::vector<double> precision) {
  const MatrixXd G = random_matrix(random, rows, n);
  const VectorXd y = random_matrix(random, rows, 1);
  return {"linear",
          [G, y](int, const VectorXd& x, VectorXd& error, MatrixXd* J) {
            error = -y;
            error.noalias() += G * x;
            if (J) *J = G;
          },
          std::move(precision)};
}

Path rest(const Problem& problem) {
  return Path(static_cast<std::size_t>(problem.horizon) + 1, problem.start);
}

/// The whole trajectory at once, as a sparse least-squares problem that knows no messages.
VectorXd sparse_solution(const Problem& problem) {
  const int n = problem.dim(), T = problem.horizon;
  const Process& p = problem.process;
  const MatrixXd Winv = p.W.llt().solve(MatrixXd::Identity(n, n));
  std::vector<Eigen::Triplet<double>> entries;
  VectorXd g = VectorXd::Zero(Eigen::Index{n} * T);
  const auto add = [&](int row, int column, const MatrixXd& block) {
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n; ++j) entries.emplace_back(n * row + i, n * column + j, block(i, j));
  };
  for (int t = 0; t < T; ++t) {  // |x_{t+1} - A x_t - a|^2; block t is x_{t+1}
    add(t, t, Winv);
    const VectorXd known = t == 0 ? VectorXd(p.a + p.A * problem.start) : p.a;
    g.segment(Eigen::Index{n} * t, n) += Winv * known;
    if (t > 0) {
      add(t - 1, t - 1, p.A.transpose() * Winv * p.A);
      add(t - 1, t, -p.A.transpose() * Winv);
      add(t, t - 1, -Winv * p.A);
      g.segment(Eigen::Index{n} * (t - 1), n) -= p.A.transpose() * Winv * known;
    }
    const Quadratic q = linearise(problem, t + 1, VectorXd::Zero(n));
    add(t, t, q.R);
    g.segment(Eigen::Index{n} * t, n) += q.r;
  }
  Eigen::SparseMatrix<double> H(Eigen::Index{n} * T, Eigen::Index{n} * T);
  H.setFromTriplets(entries.begin(), entries.end());
  return Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>>(H).solve(g);
}

Problem random_problem(std::mt19937_64& random, int n, int T, bool dynamic) {
  Problem problem;
  problem.horizon = T;
  if (dynamic) {
    problem.process = pseudo_dynamic(n, 0.1, 1, 1e-2);
  } else {
    const MatrixXd M = random_matrix(random, n, n);
    problem.process = kinematic(M * M.transpose() / n + MatrixXd::Identity(n, n));
    problem.process.a = random_matrix(random, n, 1) / 10;
  }
  const int dim = problem.dim();
  problem.start = random_matrix(random, dim, 1);
  problem.tasks.push_back(linear_task(random, 2, dim, constant_precision(T, 0.3)));
  problem.tasks.push_back(linear_task(random, n / 2, dim, final_precision(T, 50)));
  return problem;
}

// One forward and one backward pass are the exact posterior. Rounding: condition of W (1e4 with dynamics)
// times eps times T; 1e-7 leaves three digits.
TEST(Sweeps, RandomLinearGaussianProblemsEqualTheSolutionOfAllSlices) {
  std::mt19937_64 random(11);
  for (bool dynamic : {false, true})
    for (int n = 4; n <= 13; n += 3)
      for (int T : {15, 40, 100}) {
        const Problem problem = random_problem(random, n, T, dynamic);
        const auto result = aico(problem, rest(problem), {.damping = 0, .max_step = 1e6});
        const VectorXd all = sparse_solution(problem);
        const int dim = problem.dim();
        for (int t = 1; t <= T; ++t)
          EXPECT_LT(
              (result.mean[t] - all.segment(Eigen::Index{dim} * (t - 1), dim)).lpNorm<Eigen::Infinity>(),
              1e-7)
              << dynamic << " " << n << " " << T;
        EXPECT_EQ(result.mean[0], problem.start);
      }
}

/// A planar arm of unit links reaches for a point; x = (q, v) with dynamics.
Task reach(int joints, const Eigen::Vector2d& target, std::vector<double> precision) {
  return {"tip",
          [=](int, const VectorXd& x, VectorXd& error, MatrixXd* J) {
            error = -target;
            if (J) J->setZero(2, x.size());
            double angle = 0;
            for (int i = 0; i < joints; ++i) {
              angle += x[i];
              error += Eigen::Vector2d(std::cos(angle), std::sin(angle));
              if (J) J->leftCols(i + 1).colwise() += Eigen::Vector2d(-std::sin(angle), std::cos(angle));
            }
          },
          std::move(precision)};
}

Problem dynamic_reach(int joints, int T, double noise_rate) {
  Problem problem{pseudo_dynamic(joints, 0.1, 1, noise_rate), T, VectorXd::Zero(2 * joints), {}};
  problem.start.head(joints).setConstant(0.3);
  problem.tasks.push_back(reach(joints, Eigen::Vector2d(-0.5, 0.5 * joints), final_precision(T, 1e3)));
  return problem;
}

TEST(Sweeps, EveryModeEndsInTheSameKinematicMinimum) {
  Problem problem{kinematic(0.02 * MatrixXd::Identity(3, 3)), 30, Eigen::Vector3d(0.3, 0.4, 0.5), {}};
  problem.tasks.push_back(reach(3, Eigen::Vector2d(-1, 1.5), final_precision(30, 1e3)));
  const auto oracle = gauss_newton(problem, rest(problem), {.cost_tolerance = 1e-12, .step_tolerance = 1e-9});
  for (auto mode :
       {SweepMode::forward, SweepMode::symmetric, SweepMode::local_gauss_newton, SweepMode::whole}) {
    AicoParams params{.step_tolerance = 1e-8, .cost_tolerance = 1e-12};
    params.mode = mode;
    const auto result = aico(problem, rest(problem), params);
    // Where the cost is flat to 1e-12 of itself (about 1e2), it is within 1e-9 of the minimum.
    EXPECT_NEAR(result.costs.back(), oracle.costs.back(), 1e-6) << name_of(mode);
    for (std::size_t i = 1; i < result.costs.size(); ++i) EXPECT_LE(result.costs[i], result.costs[i - 1]);
  }
}

// In the mode `whole` with proximal damping the messages solve the damped normal equations: the same steps,
// one by one.
TEST(Sweeps, WholeProximalSweepsAreGaussNewtonSteps) {
  const Problem problem = dynamic_reach(3, 25, 1e-4);
  for (int steps : {1, 2, 5, 8}) {
    AicoParams params{.max_sweeps = steps, .proximal = true, .step_tolerance = 0, .cost_tolerance = 0};
    params.mode = SweepMode::whole;
    const auto sweeps = aico(problem, rest(problem), params);
    const auto newton =
        gauss_newton(problem, rest(problem), {.max_steps = steps, .cost_tolerance = 0, .step_tolerance = 0});
    // W's condition is 1e5, Gauss-Newton's normal equations carry it.
    for (std::size_t t = 0; t < newton.path.size(); ++t)
      EXPECT_LT((sweeps.mean[t] - newton.path[t]).lpNorm<Eigen::Infinity>(), 1e-6) << steps;
    EXPECT_EQ(sweeps.costs.size(), newton.costs.size());
  }
}

/// A point of unit mass goes from (-1, 0.1) to (1, 0.1) round a disc of 0.5 m: one hinge at every slice.
Problem round_a_disc(double noise_rate, double precision) {
  const int T = 20;
  Problem problem{pseudo_dynamic(2, 0.1, 1, noise_rate), T, Eigen::Vector4d(-1, 0.1, 0, 0), {}};
  problem.tasks.push_back(state_task(Eigen::Vector4d(1, 0.1, 0, 0), final_precision(T, 1e4)));
  problem.tasks.push_back({"disc",
                           [](int, const VectorXd& x, VectorXd& error, MatrixXd* J) {
                             const double r = x.head<2>().norm();
                             error = VectorXd::Constant(1, std::max(0.0, 1 - (r - 0.5) / 0.2));
                             if (!J) return;
                             J->setZero(1, 4);
                             J->leftCols(2) = -x.head<2>().transpose() / (0.2 * r);
                           },
                           constant_precision(T, precision), true});
  return problem;
}
Path straight_line(const Problem& problem) {
  Path path = rest(problem);
  for (int t = 0; t <= problem.horizon; ++t) path[t][0] = -1 + 2.0 * t / problem.horizon;
  return path;
}

// Why literal pseudo-dynamic AICO stalls: W^-1 is about 1 / noise = 1e6 across the direction of the control.
// A sweep that linearises slice by slice leaves neighbours whose beliefs come of different linearisations;
// they miss x_{t+1} = A x_t + B u by little, and W^-1 prices that above all that was gained. Damping beliefs
// alone adds to the misfit. Damping the messages helps where noise is larger; linearising all slices together
// mends it: no misfit, Gauss-Newton.
TEST(Sweeps, LiteralPseudoDynamicSweepsStallAndWholeProximalOnesDoNot) {
  const Problem problem = round_a_disc(1e-6, 5);
  const auto search = [&](bool proximal, SweepMode mode) {
    AicoParams params{.proximal = proximal};
    params.mode = mode;
    return aico(problem, straight_line(problem), params);
  };
  const auto literal = search(false, SweepMode::symmetric);
  EXPECT_EQ(literal.outcome, AicoOutcome::stalled);
  EXPECT_LE(literal.accepted, 3);
  const auto damped = search(true, SweepMode::symmetric), whole = search(true, SweepMode::whole);
  EXPECT_EQ(whole.outcome, AicoOutcome::converged);
  const double least = gauss_newton(problem, straight_line(problem), {}).costs.back();
  EXPECT_NEAR(whole.costs.back(), least, 1e-3 * least);
  EXPECT_GT(literal.costs.back(), 1.3 * least);  // half as much again
  EXPECT_GT(damped.costs.back(), 1.1 * least);   // damping the messages alone is not enough here
}

TEST(Sweeps, TheAnswerAddsUp) {
  const Problem problem = dynamic_reach(2, 20, 1e-3);
  AicoParams params{.proximal = true};
  params.mode = SweepMode::whole;
  const auto result = aico(problem, rest(problem), params);
  ASSERT_EQ(result.tasks.size(), 1u);
  EXPECT_EQ(result.tasks[0].task, "tip");
  EXPECT_NEAR(result.control_cost + result.tasks[0].cost, result.costs.back(), 1e-9 * result.costs.front());
  VectorXd error;
  problem.tasks[0].evaluate(20, result.mean.back(), error, nullptr);
  EXPECT_DOUBLE_EQ(result.tasks[0].final_error, error.norm());
}

// u_t = K x_t + k takes the mean of slice t to that of t + 1 where there is no noise beside the control.
TEST(Sweeps, ThePolicyRollsOutToTheMean) {
  std::mt19937_64 random(5);
  const Problem problem = random_problem(random, 5, 20, false);
  const auto result = aico(problem, rest(problem), {.damping = 0, .max_step = 1e6});
  const Process& p = problem.process;
  VectorXd x = problem.start;
  for (std::size_t t = 0; t < result.policy.size(); ++t) {
    x = VectorXd(p.A * x + p.a + p.B * (result.policy[t].gain * x + result.policy[t].offset));
    EXPECT_LT((x - result.mean[t + 1]).lpNorm<Eigen::Infinity>(), 1e-9);
  }
}

// Riccati's recursion of the linear-quadratic regulator, without messages. Noise of 1e-9 a step against task
// precisions of 50: gains differ by 5e-8 of themselves.
TEST(Sweeps, GainsAreThoseOfTheRegulator) {
  std::mt19937_64 random(6);
  const int T = 25;
  Problem problem{pseudo_dynamic(2, 0.1, 1, 1e-8), T, random_matrix(random, 4, 1), {}};
  problem.tasks.push_back(linear_task(random, 3, 4, constant_precision(T, 0.5)));
  problem.tasks.push_back(linear_task(random, 4, 4, final_precision(T, 50)));
  const auto result = aico(problem, rest(problem), {.damping = 0, .max_step = 1e6});
  const Process& p = problem.process;
  MatrixXd P = linearise(problem, T, problem.start).R;
  for (int t = T - 1; t >= 0; --t) {
    const MatrixXd K = (p.H + p.B.transpose() * P * p.B).ldlt().solve(p.B.transpose() * P * p.A);
    EXPECT_LT((result.policy[t].gain + K).norm(), 1e-5 * K.norm()) << t;
    P = MatrixXd(p.A.transpose() * P * (p.A - p.B * K));
    if (t > 0) P += linearise(problem, t, problem.start).R;
  }
}

// Blocks of the inverse of the normal equations of x_1 .. x_T.
TEST(Sweeps, PairCovariancesAreThoseOfTheWholeTrajectory) {
  std::mt19937_64 random(7);
  const int T = 6, n = 4;
  const Problem problem = random_problem(random, n, T, false);
  const auto result = aico(problem, rest(problem), {.damping = 0, .max_step = 1e6});
  const Process& p = problem.process;
  const MatrixXd Winv = p.W.inverse();
  MatrixXd H = MatrixXd::Zero(n * T, n * T);
  for (int t = 0; t < T; ++t) {
    H.block(n * t, n * t, n, n) += Winv + linearise(problem, t + 1, problem.start).R;
    if (t == 0) continue;
    H.block(n * (t - 1), n * (t - 1), n, n) += p.A.transpose() * Winv * p.A;
    H.block(n * (t - 1), n * t, n, n) -= p.A.transpose() * Winv;
    H.block(n * t, n * (t - 1), n, n) -= Winv * p.A;
  }
  const MatrixXd covariance = H.inverse();
  for (int t = 1; t < T; ++t) {
    EXPECT_LT((result.covariance[t] - covariance.block(n * (t - 1), n * (t - 1), n, n)).norm(), 1e-9);
    EXPECT_LT((result.pair_covariance[t] - covariance.block(n * (t - 1), n * t, n, n)).norm(), 1e-9);
  }
}

// A constant mass of 2 and no other force is the double integrator with four times the control cost.
TEST(Dynamic, AConstantMassScalesTheControlCost) {
  const int T = 20;
  Problem unit{pseudo_dynamic(1, 0.1, 4, 1e-4), T, VectorXd::Zero(2), {}};
  unit.tasks.push_back(state_task(Eigen::Vector2d(1, 0), final_precision(T, 1e3)));
  Problem heavy = unit;
  heavy.process = pseudo_dynamic(1, 0.1, 1, 1e-4);
  heavy.model = dynamic(1, 0.1, 1, [](const VectorXd&, const VectorXd&, MatrixXd& mass, VectorXd& force) {
    mass(0, 0) = 2;
    force[0] = 0;
  });
  const auto a = aico(unit, rest(unit), {.damping = 0, .max_step = 100});
  const auto b = aico(heavy, rest(heavy), {.damping = 0, .max_step = 100});
  for (int t = 0; t <= T; ++t) EXPECT_LT((a.mean[t] - b.mean[t]).norm(), 1e-8);
  for (int t = 0; t < T; ++t)  // the same motion wants twice the force
    EXPECT_NEAR((b.policy[t].gain * b.mean[t] + b.policy[t].offset)[0],
                2 * (a.policy[t].gain * a.mean[t] + a.policy[t].offset)[0], 1e-5);
}

// A pendulum of 1 kg on 1 m is raised to the horizontal. The controls of the policy, played on the equations
// of motion (exact zero-order hold is good to tau^3 x jerk a step), end there.
TEST(Dynamic, APendulumIsRaisedAgainstGravity) {
  const int T = 60;
  const double tau = 0.05;
  Problem problem{pseudo_dynamic(1, tau, 1e-2, 1e-4), T, VectorXd::Zero(2), {}};
  problem.model =
      dynamic(1, tau, 1e-2, [](const VectorXd& q, const VectorXd&, MatrixXd& mass, VectorXd& force) {
        mass(0, 0) = 1;
        force[0] = -9.81 * std::sin(q[0]);
      });
  problem.tasks.push_back(state_task(Eigen::Vector2d(M_PI / 2, 0), final_precision(T, 1e4)));
  AicoParams params{.max_sweeps = 300, .proximal = true, .step_tolerance = 1e-6, .cost_tolerance = 1e-9};
  params.mode = SweepMode::whole;
  const auto result = aico(problem, rest(problem), params);
  EXPECT_LT(result.costs.back(), result.costs.front() / 10);
  EXPECT_LT(result.tasks[0].final_error, 0.02);
  Eigen::Vector2d x = problem.start;
  double work = 0;
  for (int t = 0; t < T; ++t) {
    const double u = (result.policy[t].gain * x + result.policy[t].offset)[0];
    for (int k = 0; k < 20; ++k) {  // Heun's rule, 20 steps within a hold
      const double h = tau / 20;
      const auto f = [u](const Eigen::Vector2d& s) {
        return Eigen::Vector2d(s[1], u - 9.81 * std::sin(s[0]));
      };
      const Eigen::Vector2d k1 = f(x), k2 = f(x + h * k1), before = x;
      x += h / 2 * (k1 + k2);
      work += u * (x[0] - before[0]);
    }
  }
  EXPECT_LT((x - Eigen::Vector2d(M_PI / 2, 0)).norm(), 0.05);
  EXPECT_NEAR(work, 9.81, 0.3);  // the height gained, friction is none
}

TEST(Sweeps, SearchesAllocateNothing) {
  if (!tests::allocations_are_counted()) GTEST_SKIP() << "a sanitizer counts here";
  std::mt19937_64 random(8);
  for (bool dynamic : {false, true})
    for (auto mode : {SweepMode::symmetric, SweepMode::whole}) {
      Problem problem = random_problem(random, 13, 50, dynamic);
      const int dim = problem.dim();
      problem.tasks.push_back(
          limits_task(VectorXd::Constant(dim, -1), VectorXd::Constant(dim, 1), constant_precision(50, 10)));
      AicoParams params{.proximal = true};
      params.mode = mode;
      Aico search(problem, params);
      GaussNewton newton(problem, {});
      const Path initial = rest(problem);
      search.search(initial);  // tasks take their memory
      newton.search(initial);
      const long before = tests::allocations();
      const int sweeps = search.search(initial).sweeps;
      EXPECT_EQ(tests::allocations() - before, 0) << dynamic << " " << name_of(mode);
      EXPECT_GT(sweeps, 1);
      newton.search(initial);
      EXPECT_EQ(tests::allocations() - before, 0) << dynamic;
      const std::vector<double> one(10);
      EXPECT_GT(tests::allocations() - before, 0) << "the counter counts";
    }
}

}  // namespace
}  // namespace geocage::motion
