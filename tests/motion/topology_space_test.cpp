#include "motion/topology_space.h"

#include <gtest/gtest.h>

#include "motion/tasks/limits.h"
#include "motion/tasks/state.h"

namespace geocage::motion {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

VectorXd one(double value) {
  return VectorXd::Constant(1, value);
}

Task affine(double slope, double offset) {
  return {"phi",
          [=](int, const VectorXd& x, VectorXd& error, MatrixXd* J) {
            error = VectorXd::Constant(1, slope * x[0] + offset);
            if (J) *J = MatrixXd::Constant(1, 1, slope);
          },
          {}};
}

AicoParams undamped() {
  return {.damping = 0, .max_step = 100};
}

Problem ladder(double coupling, int T = 10) {
  const Problem walk{kinematic(MatrixXd::Identity(1, 1)), T, one(0), {}};
  TopologySpace space{affine(2, 0.5), one(0.5), 0.1, coupling, {}};
  space.tasks.push_back(state_task(one(2.5), final_precision(T, 1e3)));
  return augmented(walk, space);
}
AicoResult solved(const Problem& problem) {
  return aico(problem, std::vector<VectorXd>(static_cast<std::size_t>(problem.horizon) + 1, problem.start),
              undamped());
}

struct Golden {
  double coupling, x5, y5, x10, y10;
};

// Scalar ladder of 10 rungs, solved densely elsewhere. At 1e6 the condition of the rungs costs digits.
TEST(TopologySpace, GoldenValuesOfTheLadder) {
  for (const auto& g : {Golden{0.1, .493209966, 1.496383420, .882598472, 2.497957912},
                        Golden{100, .499484990, 1.498969979, .998726919, 2.497952112},
                        Golden{1e6, .499488025, 1.498976049, .998976025, 2.497952099}}) {
    const auto mean = solved(ladder(g.coupling)).mean;
    const double digits = g.coupling > 1e3 ? 1e-7 : 1e-8;
    EXPECT_NEAR(mean[5][0], g.x5, digits) << g.coupling;
    EXPECT_NEAR(mean[5][1], g.y5, digits) << g.coupling;
    EXPECT_NEAR(mean[10][0], g.x10, digits) << g.coupling;
    EXPECT_NEAR(mean[10][1], g.y10, digits) << g.coupling;
  }
}

TEST(TopologySpace, WithoutCouplingTheChainsGoTheirOwnWays) {
  const auto mean = solved(ladder(1e-12)).mean;
  for (int t = 0; t <= 10; ++t) {
    EXPECT_NEAR(mean[t][0], 0, 1e-9);
    // y alone: a random walk of variance 0.1 a step to 2.5 with precision 1e3, from 0.5.
    EXPECT_NEAR(mean[t][1], 0.5 + t / 10.0 * 2 * 1e3 / (1e3 + 1 / (10 * 0.1)), 1e-9);
  }
}

TEST(TopologySpace, FirmCouplingMakesYTheImageOfX) {
  const auto mean = solved(ladder(1e6)).mean;
  for (int t = 1; t <= 10; ++t) EXPECT_NEAR(mean[t][1], 2 * mean[t][0] + 0.5, 1e-5);
}

// Where y is held at every slice its chain says nothing more: targets of x with the precision of the
// coupling. Holding with 1e9 against 0.3 leaves 3e-10 of the targets.
TEST(TopologySpace, AHeldYIsATarget) {
  const int T = 10;
  const double coupling = 0.3;
  Problem walk{kinematic(MatrixXd::Identity(1, 1)), T, one(0), {}};
  TopologySpace space{affine(2, 0.5), one(0.5), 1, coupling, {}};
  for (int t = 1; t <= T; ++t) {
    auto precision = constant_precision(T, 0);
    precision[static_cast<std::size_t>(t)] = 1e9;
    space.tasks.push_back(state_task(one(0.5 + 0.2 * t), precision));
  }
  const auto with = solved(augmented(walk, space));
  walk.tasks.push_back({"target",
                        [](int t, const VectorXd& x, VectorXd& error, MatrixXd* J) {
                          error = VectorXd::Constant(1, 2 * x[0] - 0.2 * t);
                          if (J) *J = MatrixXd::Constant(1, 1, 2);
                        },
                        constant_precision(T, coupling)});
  const auto alone = solved(walk);
  for (int t = 0; t <= T; ++t) EXPECT_NEAR(with.mean[t][0], alone.mean[t][0], 1e-7);
}

TEST(TopologySpace, TheBridgeIsWidestInTheMiddle) {
  const auto profile = bridge_precision(10, 2, 0.1, 1e3);
  EXPECT_DOUBLE_EQ(profile[5], 1 / (0.5 + 5 * 0.5 * 0.1 + 0.25 / 1e3));
  EXPECT_DOUBLE_EQ(profile[10], 1 / (0.5 + 1 / 1e3));
}

// (i) posture, (ii) what is wanted of it, (iii) motion. phi = x^2 is nonlinear; the wish halves it.
TEST(TopologySpace, ThePipelineOfThreeSteps) {
  const int T = 20;
  Problem walk{kinematic(MatrixXd::Constant(1, 1, 0.05)), T, one(0.5), {}};
  walk.tasks.push_back(state_task(one(2), final_precision(T, 1e4)));
  const Task square{"square",
                    [](int, const VectorXd& x, VectorXd& error, MatrixXd* J) {
                      error = VectorXd::Constant(1, x[0] * x[0]);
                      if (J) *J = MatrixXd::Constant(1, 1, 2 * x[0]);
                    },
                    {}};
  const auto plan = hierarchical(walk, square, 1e2, [](const VectorXd& y) { return VectorXd(y / 2); }, {});
  EXPECT_NEAR(plan.posture[0], 2, 1e-3);  // precision 1e4 against 1 / (20 x 0.05)
  EXPECT_DOUBLE_EQ(plan.y_first[0], 0.25);
  EXPECT_NEAR(plan.y_last[0], 2, 5e-3);
  // Halfway, where the end's own task doesn't reach: x^2 follows the interpolation of 0.25 and 2 at 7 / 20.
  EXPECT_NEAR(std::pow(plan.motion.mean[7][0], 2), 0.25 + 0.35 * (2 - 0.25), 0.05);
}

}  // namespace
}  // namespace geocage::motion
