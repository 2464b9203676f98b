#include "stages/approach/approach.h"

#include <gtest/gtest.h>
#include <omp.h>

#include "datasets/shapes.h"
#include "geometry/clearance.h"
#include "hands/closing.h"

namespace geocage::stages {
namespace {

using geometry::Pose;
using geometry::Vec3;

/// The SDH closed over a ball of 35 mm, its palm 25 mm away, from `side`.
class ApproachTest : public testing::Test {
 protected:
  hands::GraspSet grasp_from(const Vec3& side) const {
    Pose X_OH = Pose::Identity();
    X_OH.linear() = geometry::frame_from_z(-side);
    X_OH.translation() = (0.035 + 0.025) * side - X_OH.linear() * hand_.palm_H;
    const auto closed = hands::close_hand(hand_, field_, X_OH, hand_.open_rad, {});
    EXPECT_EQ(closed.outcome, hands::Closure::closed);
    hands::Grasp grasp;
    grasp.X_OH = hands::file_pose(X_OH);
    grasp.joints_rad = hands::joint_map(hand_.tree, closed.q);
    grasp.pregrasp_joints_rad = hands::joint_map(hand_.tree, hand_.open_rad);
    return {{grasp}, {}};
  }
  motion::Trajectory plan(const hands::GraspSet& grasps, const geometry::PointCloud& cloud = {}) const {
    pipeline::Run run;
    return approach({}, run, grasps, field_, cloud, {}, hand_).trajectories.at(0);
  }
  std::vector<hands::PlacedCapsule> capsules(const motion::Trajectory& t, std::size_t i) const {
    return hands::placed_capsules(hand_, t.X_OH[i],
                                  Eigen::Map<const Eigen::VectorXd>(t.q_rad[i].data(), hand_.tree.dofs()));
  }

  const hands::Hand hand_ = hands::load_hand("schunk_sdh");
  const geometry::SignedDistanceField field_ =
      geometry::build_distance_field(datasets::icosphere(0.035, 4), {40, 0.04, 2});
};

TEST_F(ApproachTest, StartsOpenAndFarAndEndsAtTheGrasp) {
  const auto grasps = grasp_from(Vec3(0.2, 0.1, 1).normalized());
  const auto& grasp = grasps.grasps[0];
  const auto t = plan(grasps);
  ASSERT_EQ(t.outcome, "planned");
  EXPECT_EQ(t.joints, hand_.tree.dof_names);
  EXPECT_GT((t.X_OH.front().translation() - grasp.X_OH.translation()).norm(), 0.299);
  EXPECT_EQ(t.X_OH.back().matrix(), grasp.X_OH.matrix());
  for (std::size_t i = 0; i < t.joints.size(); ++i) {
    EXPECT_EQ(t.q_rad.back()[i], grasp.joints_rad.at(t.joints[i]));
    EXPECT_EQ(t.q_rad.front()[i], grasp.pregrasp_joints_rad.at(t.joints[i]));
  }
  EXPECT_TRUE(t.certified);
}

// The ball is known in closed form: distance of a capsule to it is that of its segment to the origin.
TEST_F(ApproachTest, KeepsItsClearanceUntilItCloses) {
  const auto t = plan(grasp_from(Vec3::UnitZ()));
  ASSERT_EQ(t.outcome, "planned");
  double least = 1;
  for (std::size_t i = 0; i < static_cast<std::size_t>(t.free_steps); ++i)
    for (const auto& c : capsules(t, i)) {
      const Vec3 along = c.b - c.a;
      const double s = std::clamp(-c.a.dot(along) / std::max(along.squaredNorm(), 1e-12), 0.0, 1.0);
      least = std::min(least, (c.a + s * along).norm() - 0.035 - c.radius_m);
    }
  EXPECT_GT(least, 0);
  // What is proven is at most what is, plus the sag of the mesh (0.04 mm), and at most 1 mm (resolution), the
  // field's bound (0.3 mm with cells of 2 mm) and what passes between waypoints below.
  EXPECT_LE(t.min_clearance_m, least + 5e-5);
  EXPECT_GE(t.min_clearance_m, least - 0.002);
}

TEST_F(ApproachTest, KeepsSpeedAccelerationAndLimits) {
  const ApproachParams p;
  const auto t = plan(grasp_from(Vec3(1, -1, 1).normalized()));
  ASSERT_EQ(t.outcome, "planned");
  for (std::size_t i = 0; i + 1 < t.q_rad.size(); ++i) {
    EXPECT_LE((t.X_OH[i + 1].translation() - t.X_OH[i].translation()).norm() / t.dt_s,
              p.base_speed_m_s * (1 + 1e-9));
    for (int k = 0; k < hand_.tree.dofs(); ++k) {
      const double v = (t.q_rad[i + 1][k] - t.q_rad[i][k]) / t.dt_s;
      const double before = i > 0 ? (t.q_rad[i][k] - t.q_rad[i - 1][k]) / t.dt_s : 0;
      EXPECT_LE(std::abs(v), hand_.tree.velocity_limit_rad_s[k] * (1 + 1e-9));
      EXPECT_LE(std::abs(v - before) / t.dt_s, p.joint_acceleration_rad_s2 * (1 + 1e-9));
      EXPECT_LE(t.q_rad[i][k], hand_.tree.upper_rad[k] + 1e-6);
      EXPECT_GE(t.q_rad[i][k], hand_.tree.lower_rad[k] - 1e-6);
    }
  }
}

TEST_F(ApproachTest, StaysAboveTheSupport) {
  geometry::PointCloud cloud;
  cloud.support = geometry::Plane{Vec3::UnitZ(), -0.15};
  const auto t = plan(grasp_from(Vec3(1, 0, 0.6).normalized()), cloud);
  ASSERT_EQ(t.outcome, "planned") << t.outcome;
  for (std::size_t i = 0; i < static_cast<std::size_t>(t.free_steps); ++i)
    for (const auto& c : capsules(t, i)) EXPECT_GE(std::min(c.a.z(), c.b.z()) - c.radius_m, -0.15 - 5e-4);
}

TEST_F(ApproachTest, ABlockedGraspHasNoPathAndSaysHowDeep) {
  auto grasps = grasp_from(Vec3::UnitZ());
  geometry::PointCloud cloud;
  cloud.support = geometry::Plane{Vec3::UnitZ(), 0.05};  // the grasp itself is below the table
  const auto t = plan(grasps, cloud);
  EXPECT_TRUE(t.outcome.starts_with("no path: ")) << t.outcome;
  EXPECT_NE(t.outcome.find("mm deep"), std::string::npos);
  EXPECT_TRUE(t.X_OH.empty());
}

// A plate above the hand: every scripted way goes through it, the way round it does not.
TEST_F(ApproachTest, GoesRoundAPlateWhereScriptsCollide) {
  auto mesh = datasets::icosphere(0.035, 4);
  auto plate = datasets::box(Vec3(0.3, 0.3, 0.02), 8);
  const int offset = static_cast<int>(mesh.vertices.size());
  for (const Vec3& p : plate.vertices) mesh.vertices.push_back(p + Vec3(0, 0, 0.27));
  for (const auto& t : plate.triangles)
    mesh.triangles.push_back({t[0] + offset, t[1] + offset, t[2] + offset});
  const auto field = geometry::build_distance_field(mesh, {80, 0.04, 2});
  const auto grasps = grasp_from(Vec3::UnitZ());
  std::vector<std::vector<double>> first;
  for (int round = 0; round < 2; ++round) {
    pipeline::Run run;
    const auto t = approach({.start_m = 0.55}, run, grasps, field, {}, {}, hand_).trajectories.at(0);
    ASSERT_EQ(t.outcome, "planned");
    EXPECT_TRUE(t.certified);
    double widest = 0;
    for (const auto& X_OH : t.X_OH)
      widest = std::max(widest, X_OH.translation().head<2>().lpNorm<Eigen::Infinity>());
    EXPECT_GT(widest, 0.15);
    if (round == 0) first = t.q_rad;
    EXPECT_EQ(t.q_rad, first);
  }
}

// Cells of a map beside the object's way, as a wall that the ray camera saw: the hand keeps away from them,
// and cells at the object itself don't count.
TEST_F(ApproachTest, KeepsAwayFromWhatTheMapHolds) {
  const auto grasps = grasp_from(Vec3::UnitZ());
  geometry::PointCloud wall;
  for (const Vec3& p : datasets::icosphere(0.035, 3).vertices) wall.points.push_back(p);
  for (int x = -8; x <= 8; ++x)
    for (int y = -8; y <= 8; ++y) wall.points.emplace_back(0.02 * x + 0.01, 0.02 * y + 0.01, 0.45);
  const auto map = geometry::map_of_rays(wall, 0.02);
  const auto cells = geometry::other_cells(map, field_, wall, {});
  EXPECT_GT(cells.centers_O.size(), 250u);
  EXPECT_LT(cells.centers_O.size(), 400u);
  const auto others = geometry::clearance_of_others(map, cells, field_, wall, {});
  pipeline::Run run;
  const auto t = approach({.start_m = 0.55}, run, grasps, field_, {}, others, hand_).trajectories.at(0);
  ASSERT_EQ(t.outcome, "planned") << t.outcome;
  double nearest = 1;
  for (std::size_t i = 0; i < static_cast<std::size_t>(t.free_steps); ++i)
    for (const auto& c : capsules(t, i))
      for (const Vec3& p : geometry::occupied_cells(map).centers_O)
        if (p.z() > 0.4)
          for (const Vec3& end : {c.a, c.b}) nearest = std::min(nearest, (end - p).norm() - c.radius_m);
  EXPECT_GT(nearest, 0.01 - 6e-4);  // half a cell to its faces, less the tolerance
}

TEST_F(ApproachTest, SaysWhatAMotionTakes) {
  const auto t = plan(grasp_from(Vec3::UnitZ()));
  ASSERT_EQ(t.outcome, "planned");
  EXPECT_DOUBLE_EQ(t.efficiency.duration_s, t.dt_s * static_cast<double>(t.q_rad.size() - 1));
  EXPECT_GE(t.efficiency.duration_s, t.likely_duration_s * (1 - 1e-9));
  EXPECT_GT(t.efficiency.length, 3);  // 0.3 m are 3 units
  EXPECT_GT(t.efficiency.effort, 0);
  EXPECT_GE(t.self_clearance_m, -5e-4);
  EXPECT_FALSE(t.seed.empty());
}

TEST_F(ApproachTest, AnArmBringsTheHand) {
  const auto grasps = grasp_from(Vec3(-0.3, 0.2, 1).normalized());
  pipeline::Run run;
  const auto t = approach({.arm = "kuka_lwr4", .arm_placements = 2}, run, grasps, field_, {}, {}, hand_)
                     .trajectories.at(0);
  EXPECT_EQ(run.metrics().at("reached_from_placement_0") + run.metrics().at("reached_from_placement_1"), 2);
  ASSERT_EQ(t.outcome, "planned") << t.outcome;
  EXPECT_TRUE(t.certified);
  EXPECT_EQ(t.arm, "kuka_lwr4");
  EXPECT_EQ(t.joints.size(), 7u + hand_.tree.dof_names.size());
  EXPECT_LT((t.X_OH.back().translation() - grasps.grasps[0].X_OH.translation()).norm(), 2e-5);
  for (std::size_t i = 0; i < hand_.tree.dof_names.size(); ++i)
    EXPECT_EQ(t.q_rad.back()[7 + i], grasps.grasps[0].joints_rad.at(hand_.tree.dof_names[i]));
}

TEST_F(ApproachTest, AnArmThatIsTooFarSaysByHowMuch) {
  pipeline::Run run;
  const auto t = approach({.arm = "kuka_lwr4", .arm_distance_m = 2, .arm_placements = 1}, run,
                          grasp_from(Vec3::UnitZ()), field_, {}, {}, hand_)
                     .trajectories.at(0);
  EXPECT_TRUE(t.outcome.starts_with("no path: out of the arm's reach by ")) << t.outcome;
}

TEST_F(ApproachTest, MessagesAndGaussNewtonAgree) {
  pipeline::Run run;
  const auto grasps = grasp_from(Vec3::UnitZ());
  const auto newton = approach({}, run, grasps, field_, {}, {}, hand_).trajectories.at(0);
  const auto messages = approach({.search = "aico"}, run, grasps, field_, {}, {}, hand_).trajectories.at(0);
  ASSERT_EQ(messages.outcome, "planned");
  // The same steps in another arithmetic; both stop when the cost falls by less than 1e-3 of itself.
  EXPECT_NEAR(messages.efficiency.length, newton.efficiency.length, 1e-2 * newton.efficiency.length);
}

// Wrapping as the hand comes is asked for, not promised: the way is another one, and proven.
TEST_F(ApproachTest, FingersMayWrapAsTheyCome) {
  pipeline::Run run;
  const auto grasps = grasp_from(Vec3::UnitZ());
  const auto without = approach({}, run, grasps, field_, {}, {}, hand_).trajectories.at(0);
  const auto with =
      approach({.winding_precision = 10}, run, grasps, field_, {}, {}, hand_).trajectories.at(0);
  ASSERT_EQ(with.outcome, "planned");
  EXPECT_TRUE(with.certified);
  EXPECT_NE(with.q_rad, without.q_rad);
}

TEST_F(ApproachTest, SameForAnyThreadCount) {
  hands::GraspSet grasps;
  for (const Vec3& side : {Vec3(0, 0, 1), Vec3(1, 0, 0), Vec3(0, -1, 0)})
    grasps.grasps.push_back(grasp_from(side).grasps[0]);
  std::vector<std::vector<std::vector<double>>> answers[2];
  for (int threads : {1, 3}) {
    omp_set_num_threads(threads);
    pipeline::Run run;
    for (const auto& t : approach({}, run, grasps, field_, {}, {}, hand_).trajectories)
      answers[threads > 1].push_back(t.q_rad);
    EXPECT_EQ(run.metrics().at("no_path"), 0);
  }
  EXPECT_EQ(answers[0], answers[1]);
}

}  // namespace
}  // namespace geocage::stages
