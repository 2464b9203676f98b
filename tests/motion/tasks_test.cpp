// Every task variable of a body against numerical differences, on random postures of a floating hand and of
// an arm.
#include <random>

#include <gtest/gtest.h>

#include "datasets/shapes.h"
#include "geometry/clearance.h"
#include "hands/arm.h"
#include "hands/closing.h"
#include "motion/tasks/chain.h"
#include "motion/tasks/clearance.h"
#include "motion/tasks/frame.h"
#include "motion/tasks/interaction_mesh.h"
#include "motion/tasks/limits.h"
#include "motion/tasks/self_clearance.h"
#include "motion/tasks/state.h"
#include "motion/tasks/winding.h"
#include "motion/tasks/writhe.h"

namespace geocage::motion {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

const hands::Hand& hand() {
  static const hands::Hand only = hands::load_hand("schunk_sdh");
  return only;
}
const hands::ArmedHand& armed() {
  static const hands::ArmedHand only = hands::on_arm(hands::load_arm("kuka_lwr4"), hand());
  return only;
}

class TaskTest : public testing::TestWithParam<bool> {
 protected:
  TaskTest()
      : mover_(GetParam() ? Mover::standing(armed().body, Pose(Eigen::Translation3d(-0.5, 0, -0.2)))
                          : Mover::floating(hand(), Pose(Eigen::Translation3d(0.02, -0.01, -0.17)))) {}

  VectorXd random_state() {
    std::uniform_real_distribution<> unit(-1, 1);
    VectorXd x(mover_.dim());
    for (auto& value : x) value = 0.6 * unit(random_);
    if (GetParam()) x.head(7) += armed().body.open_rad.head(7);
    return x;
  }
  LinkFrame some_frame(int link) const {
    return {link, Vec3(0.01, -0.02, 0.05), exponential(Vec3(0.3, -0.2, 0.5))};
  }
  int last_link() const { return static_cast<int>(mover_.hand().tree.links.size()) - 1; }

  /// Central differences: step^2 x third derivative (1e-10 x 1e2) and rounding (1e-11). Rows within a step of
  /// a kink have two slopes; `kinks` allows for as much as they differ.
  void check(const Task& task, bool kinks = false, int rounds = 20) {
    const double step = 1e-5;
    int rows = 0;
    for (int i = 0; i < rounds; ++i) {
      const VectorXd x = random_state();
      VectorXd error, up, down;
      MatrixXd J;
      task.evaluate(0, x, error, &J);
      ASSERT_EQ(J.cols(), x.size());
      ASSERT_EQ(J.rows(), error.size());
      for (int k = 0; k < x.size(); ++k) {
        const VectorXd change = step * VectorXd::Unit(x.size(), k);
        task.evaluate(0, x + change, up, nullptr);
        task.evaluate(0, x - change, down, nullptr);
        for (int r = 0; r < error.size(); ++r) {
          if (task.hinge && (error[r] == 0 || up[r] == 0 || down[r] == 0)) continue;
          ++rows;
          const double slope = (up[r] - down[r]) / (2 * step);
          const double kink = kinks ? std::abs(up[r] - 2 * error[r] + down[r]) / step : 0;
          EXPECT_NEAR(J(r, k), slope, 1e-6 * (1 + std::abs(slope)) + kink)
              << task.name << " " << r << " " << k;
        }
      }
    }
    EXPECT_GT(rows, 100) << task.name << " was hardly awake";
  }

  std::mt19937_64 random_{1};
  const Mover mover_;
  const std::vector<double> on_ = constant_precision(1, 1);
};

TEST_P(TaskTest, Position) {
  check(position_task(mover_, some_frame(last_link()), constant_target(Vec3(0.1, 0.2, 0.3)), on_));
}
TEST_P(TaskTest, Orientation) {
  check(orientation_task(
      mover_, some_frame(last_link()), [](int) { return exponential(Vec3(0.2, 0.1, -0.3)); }, on_));
}
TEST_P(TaskTest, Alignment) {
  check(alignment_task(mover_, last_link(), Vec3(1, 2, 2) / 3, Vec3::UnitZ(), on_));
}
TEST_P(TaskTest, Posture) {
  check(state_task(VectorXd::Ones(mover_.dim()), on_));
  check(posture_task(VectorXd::Ones(4), 2, on_));
}
TEST_P(TaskTest, Limits) {
  const VectorXd most = VectorXd::Constant(mover_.dim(), 0.2);
  check(limits_task(-most, most, on_), true);
}
TEST_P(TaskTest, RelativePose) {
  const int other = mover_.hand().tree.link("finger_22");
  check(relative_pose_task(
      mover_, some_frame(other), some_frame(last_link()),
      [](int) { return Pose(Eigen::Translation3d(0.1, 0, 0) * Eigen::AngleAxisd(0.3, Vec3::UnitX())); },
      on_));
}
TEST_P(TaskTest, ClearanceOfAField) {
  const auto field = geometry::build_distance_field(datasets::icosphere(0.04, 3), {24, 0.1, 1});
  check(clearance_task(mover_, {{{&field}}, geometry::Plane{Vec3::UnitZ(), -0.25}},
                       constant_precision(1, 0.3), on_),
        true, 4);
}
TEST_P(TaskTest, ClearanceOfAMap) {
  geometry::PointCloud cloud;
  const double up_m = GetParam() ? 0.15 : 0;  // near the hand of either body
  for (int i = 0; i < 8; ++i) cloud.points.emplace_back(0.02 * i, 0.1, 0.05 + up_m);
  const auto field = geometry::clearance_field(geometry::map_of_rays(cloud, 0.02), {.pad_m = 0.1});
  check(clearance_task(mover_, {{map_obstacle(field)}, {}}, constant_precision(1, 0.3), on_), true, 4);
}
TEST_P(TaskTest, SelfCollision) {
  const VectorXd open = mover_.hand().open_rad;
  const auto pairs = self_pairs(mover_.hand(), open);
  EXPECT_GT(pairs.size(), 10u);
  // The nearest points of parallel axes jump: kinks.
  check(self_clearance_task(mover_, pairs, 0.15, on_), true);
}
TEST_P(TaskTest, Winding) {
  const auto chain = chain_of(mover_, finger_points(mover_.hand(), 0));
  check(winding_task(chain, Vec3(0.02, 0.01, 0.05), Vec3(1, 2, 2) / 3, constant_target(VectorXd::Zero(1)),
                     on_));
}
// Both ends are what is asked for, and what is asked between them is as many turns as fingers make by
// closing.
TEST_P(TaskTest, FingersWrapAsTheyCome) {
  constexpr int horizon = 8;
  VectorXd start = random_state(), closed = start;
  start.tail(7) = hand().open_rad;
  closed.tail(7) = hand().open_rad + 0.6 * hand().closing_rad.cwiseProduct(hand().closing_speed);
  const auto tasks = wrapping_tasks(mover_, start, closed, horizon, 1);
  ASSERT_EQ(tasks.size(), 3u);
  for (const Task& task : tasks) {
    VectorXd first, last, across;
    task.evaluate(0, start, first, nullptr);
    task.evaluate(horizon, closed, last, nullptr);
    task.evaluate(0, closed, across, nullptr);
    EXPECT_NEAR(first[0], 0, 1e-12);
    EXPECT_NEAR(last[0], 0, 1e-12);
    EXPECT_GT(std::abs(across[0]), 0.01);
    check(task, true);
  }
}
TEST_P(TaskTest, Writhe) {
  const auto chain = chain_of(mover_, finger_points(mover_.hand(), 0));
  const auto points = static_cast<Eigen::Index>(finger_points(mover_.hand(), 0).size());
  const topology::Polyline rope = {Vec3(0.3, 0.2, -0.5), Vec3(0.35, 0.25, 0.1), Vec3(0.3, 0.3, 0.6)};
  check(writhe_task(chain, rope, WritheForm::scalar, constant_target(VectorXd::Zero(1)), on_));
  check(writhe_task(chain, rope, WritheForm::sums, constant_target(VectorXd::Zero(2)), on_));
  check(writhe_task(chain, rope, WritheForm::matrix, constant_target(VectorXd::Zero(2 * (points - 1))), on_));
}
TEST_P(TaskTest, InteractionMesh) {
  const auto chain = chain_of(mover_, finger_points(mover_.hand(), 0));
  const topology::Polyline object = {Vec3(0.3, 0.2, -0.1), Vec3(0.35, 0.25, 0.1), Vec3(0.3, 0.3, 0.2)};
  const InteractionMesh mesh(chain, object, static_cast<int>(finger_points(mover_.hand(), 0).size()));
  VectorXd now;
  mesh.evaluate(random_state(), now, nullptr);
  check(interaction_mesh_task(mesh, constant_target(VectorXd::Zero(now.size())), on_));
}

INSTANTIATE_TEST_SUITE_P(Bodies, TaskTest, testing::Bool(),
                         [](const auto& body) { return body.param ? "arm" : "floating"; });

// Weights cancel out of a single neighbour; two that are equally near count half each.
TEST(InteractionMesh, SmallMeshesByHand) {
  const MovingChain still = [](const VectorXd& x, topology::Polyline& p, MatrixXd* J) {
    p = {Vec3(x[0], 0, 0)};
    if (J) *J = MatrixXd::Identity(3, x.size());
  };
  VectorXd laplace;
  InteractionMesh(still, {Vec3(1, 0, 0)}, 1).evaluate(VectorXd::Zero(1), laplace, nullptr);
  EXPECT_EQ(laplace, (VectorXd(6) << -1, 0, 0, 1, 0, 0).finished());
  InteractionMesh(still, {Vec3(0, 2, 0), Vec3(0, 0, 2)}, 1).evaluate(VectorXd::Zero(1), laplace, nullptr);
  EXPECT_LT((laplace.head<3>() - Vec3(0, -1, -1)).norm(), 1e-15);
}

// The gap of capsules is the same computation elsewhere (hands::capsule_gap_m).
TEST(SegmentGap, EqualsTheGapOfCapsules) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<> unit(-1, 1);
  const auto point = [&] { return Vec3(unit(random), unit(random), unit(random)); };
  for (int i = 0; i < 2000; ++i) {
    const Vec3 a = point(), c = point(), b = i % 5 ? point() : a, d = i % 7 ? point() : Vec3(c + (b - a));
    const auto gap = segment_gap(a, b, c, d);
    EXPECT_NEAR(gap.distance_m, hands::capsule_gap_m({a, b, 0}, {c, d, 0}), 1e-12);
    EXPECT_NEAR((a + gap.s * (b - a) - c - gap.t * (d - c)).norm(), gap.distance_m, 1e-15);
  }
}

TEST(Rotation, LogarithmAndJacobians) {
  std::mt19937_64 random(4);
  std::uniform_real_distribution<> unit(-1.5, 1.5);
  for (int i = 0; i < 100; ++i) {
    const Vec3 w = (i < 10 ? 1e-5 : 1.0) * Vec3(unit(random), unit(random), unit(random));
    if (w.norm() > 3) continue;
    EXPECT_LT((logarithm(exponential(w)) - w).norm(), 1e-9);
    EXPECT_LT((left_jacobian(w) * inverse_left_jacobian(w) - Matrix3d::Identity()).norm(), 1e-9);
    const Vec3 dw = 1e-6 * Vec3(unit(random), unit(random), unit(random));
    EXPECT_LT((logarithm(exponential(w + dw) * exponential(w).transpose()) - left_jacobian(w) * dw).norm(),
              1e-11);
  }
}

TEST(Arm, HandsRideOnTheFlange) {
  const auto arm = hands::load_arm("kuka_lwr4");
  const auto& body = armed().body;
  EXPECT_EQ(armed().arm_dofs, 7);
  EXPECT_EQ(body.tree.dofs(), 7 + hand().tree.dofs());
  std::mt19937_64 random(5);
  std::uniform_real_distribution<> unit(-1, 1);
  for (int i = 0; i < 20; ++i) {
    const VectorXd q = VectorXd::NullaryExpr(body.tree.dofs(), [&] { return unit(random); });
    std::vector<Pose> both, alone, of_hand;
    hands::forward_kinematics(body.tree, q, both);
    hands::forward_kinematics(arm.tree, q.head(7), alone);
    hands::forward_kinematics(hand().tree, q.tail(hand().tree.dofs()), of_hand);
    const Pose X_BF = alone[static_cast<std::size_t>(arm.tree.link(arm.flange))] * arm.X_FH;
    for (std::size_t k = 0; k < of_hand.size(); ++k)
      EXPECT_LT(
          (both[static_cast<std::size_t>(armed().hand_link) + k].matrix() - (X_BF * of_hand[k]).matrix())
              .norm(),
          1e-12);
  }
  EXPECT_THROW(hands::load_arm("kuka"), std::exception);
}

}  // namespace
}  // namespace geocage::motion
