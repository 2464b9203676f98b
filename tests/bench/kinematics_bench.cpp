// Forward kinematics with the Jacobians of all links, against orocos-kdl on the same postures.
#include <random>

#include <benchmark/benchmark.h>
#include <kdl/treejnttojacsolver.hpp>

#include "hands/hand.h"
#include "tests/hands/kdl_tree.h"

namespace geocage::hands {
namespace {

std::vector<Eigen::VectorXd> postures(const KinematicTree& tree) {
  std::mt19937_64 engine(1);
  std::vector<Eigen::VectorXd> list(256, Eigen::VectorXd(tree.dofs()));
  for (auto& q : list)
    for (int i = 0; i < q.size(); ++i) {
      const double share = static_cast<double>(engine() >> 11) * 0x1p-53;
      q[i] = tree.lower_rad[i] + share * (tree.upper_rad[i] - tree.lower_rad[i]);
    }
  return list;
}

void all_jacobians(benchmark::State& state, const char* name) {
  const Hand hand = load_hand(name);
  const auto list = postures(hand.tree);
  KinematicData data(hand.tree);
  std::size_t i = 0;
  for (auto _ : state) {
    forward_kinematics(hand.tree, list[i++ % list.size()], data.X_HL);
    link_jacobians(hand.tree, data);
    benchmark::DoNotOptimize(data.link_jacobians.data());
  }
}
BENCHMARK_CAPTURE(all_jacobians, schunk_sdh, "schunk_sdh");
BENCHMARK_CAPTURE(all_jacobians, shadow, "shadow");

void all_jacobians_by_kdl(benchmark::State& state, const char* name) {
  const Hand hand = load_hand(name);
  const tests::KdlTree kdl(std::string(GEOCAGE_SOURCE_TREE) + "/hands/" + name + "/" + name + ".urdf");
  KDL::TreeJntToJacSolver solver(kdl.tree);
  KDL::Jacobian jacobian(kdl.tree.getNrOfJoints());
  KDL::JntArray q(kdl.tree.getNrOfJoints());
  const auto list = postures(hand.tree);
  std::size_t i = 0;
  for (auto _ : state) {
    q.data.setConstant(list[i++ % list.size()][0]);
    for (const auto& link : hand.tree.links) benchmark::DoNotOptimize(solver.JntToJac(q, jacobian, link));
  }
}
BENCHMARK_CAPTURE(all_jacobians_by_kdl, schunk_sdh, "schunk_sdh");
BENCHMARK_CAPTURE(all_jacobians_by_kdl, shadow, "shadow");

}  // namespace
}  // namespace geocage::hands
