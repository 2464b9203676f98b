#include "motion/rrt_connect.h"

#include <algorithm>
#include <cmath>
#include <random>

#include <ompl/base/PlannerTerminationCondition.h>
#include <ompl/base/ProblemDefinition.h>
#include <ompl/base/spaces/RealVectorStateSpace.h>
#include <ompl/geometric/PathGeometric.h>
#include <ompl/geometric/planners/rrt/RRTConnect.h>
#include <ompl/util/Console.h>

namespace geocage::motion {

namespace ob = ompl::base;
using Eigen::VectorXd;
using Space = ob::RealVectorStateSpace;

namespace {

/// Uniform in [0, 1), the same on every platform.
double uniform(std::mt19937_64& engine) {
  return static_cast<double>(engine() >> 11) * 0x1p-53;
}

/// OMPL's samplers draw their seeds from one sequence of the whole process: order of threads would matter.
class Sampler : public ob::StateSampler {
 public:
  Sampler(const ob::StateSpace* space, std::uint64_t seed) : StateSampler(space), engine_(seed) {}

  void sampleUniform(ob::State* state) override {
    const auto& bounds = space_->as<Space>()->getBounds();
    fill(state, [&](unsigned i) { return std::pair(bounds.low[i], bounds.high[i]); });
  }
  void sampleUniformNear(ob::State* state, const ob::State* near, double distance) override {
    const auto* centre = near->as<Space::StateType>();
    fill(state, [&](unsigned i) { return std::pair((*centre)[i] - distance, (*centre)[i] + distance); });
    space_->enforceBounds(state);
  }
  void sampleGaussian(ob::State* state, const ob::State* mean, double deviation) override {
    sampleUniformNear(state, mean, deviation);  // RRT-Connect never asks
  }

 private:
  template <class Interval>
  void fill(ob::State* state, Interval interval) {
    for (unsigned i = 0; i < space_->getDimension(); ++i) {
      const auto [low, high] = interval(i);
      (*state->as<Space::StateType>())[i] = low + uniform(engine_) * (high - low);
    }
  }
  std::mt19937_64 engine_;
};

VectorXd vector_of(const ob::State* state, Eigen::Index n) {
  return Eigen::Map<const VectorXd>(state->as<Space::StateType>()->values, n);
}

/// Two corners that see each other need none between them.
void shorten(std::vector<VectorXd>& path, const std::function<bool(const VectorXd&)>& free,
             const ConnectRule& rule) {
  std::mt19937_64 engine(rule.seed);
  for (int k = 0; k < rule.shortcuts && path.size() > 2; ++k) {
    auto i = static_cast<std::size_t>(uniform(engine) * static_cast<double>(path.size()));
    auto j = static_cast<std::size_t>(uniform(engine) * static_cast<double>(path.size()));
    if (i > j) std::swap(i, j);
    if (j < i + 2) continue;
    const VectorXd move = path[j] - path[i];
    const int samples = 1 + static_cast<int>(move.norm() / (rule.range * rule.sample_every));
    bool clear = true;
    for (int s = 1; s < samples && clear; ++s) clear = free(path[i] + double(s) / samples * move);
    if (clear)
      path.erase(path.begin() + static_cast<std::ptrdiff_t>(i) + 1,
                 path.begin() + static_cast<std::ptrdiff_t>(j));
  }
}

}  // namespace

Connection rrt_connect(const VectorXd& start, const VectorXd& goal, const VectorXd& lower,
                       const VectorXd& upper, const std::function<bool(const VectorXd&)>& free,
                       const ConnectRule& rule) {
  if (!free(start)) return {ConnectOutcome::start_blocked, {}};
  if (!free(goal)) return {ConnectOutcome::goal_blocked, {}};
  ompl::msg::noOutputHandler();
  const Eigen::Index n = start.size();
  auto space = std::make_shared<Space>(static_cast<unsigned>(n));
  ob::RealVectorBounds bounds(static_cast<unsigned>(n));
  for (Eigen::Index i = 0; i < n; ++i) {
    bounds.setLow(static_cast<unsigned>(i), lower[i]);
    bounds.setHigh(static_cast<unsigned>(i), upper[i]);
  }
  space->setBounds(bounds);
  space->setStateSamplerAllocator(
      [&](const ob::StateSpace* s) { return std::make_shared<Sampler>(s, rule.seed); });
  auto information = std::make_shared<ob::SpaceInformation>(space);
  information->setStateValidityChecker([&](const ob::State* state) { return free(vector_of(state, n)); });
  information->setStateValidityCheckingResolution(rule.range * rule.sample_every / space->getMaximumExtent());
  information->setup();
  ob::ScopedState<Space> from(space), to(space);
  for (Eigen::Index i = 0; i < n; ++i) {
    from[static_cast<unsigned>(i)] = start[i];
    to[static_cast<unsigned>(i)] = goal[i];
  }
  auto problem = std::make_shared<ob::ProblemDefinition>(information);
  problem->setStartAndGoalStates(from, to);
  ompl::geometric::RRTConnect planner(information);
  planner.setRange(rule.range);
  planner.setProblemDefinition(problem);
  planner.setup();
  int iterations = 0;
  const ob::PlannerTerminationCondition enough([&] { return ++iterations > rule.iterations; });
  if (planner.solve(enough) != ob::PlannerStatus::EXACT_SOLUTION) return {ConnectOutcome::gave_up, {}};
  Connection answer{ConnectOutcome::found, {}};
  for (const ob::State* state : problem->getSolutionPath()->as<ompl::geometric::PathGeometric>()->getStates())
    answer.path.push_back(vector_of(state, n));
  answer.path.front() = start;
  answer.path.back() = goal;
  shorten(answer.path, free, rule);
  return answer;
}

}  // namespace geocage::motion
