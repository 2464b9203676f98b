#include "motion/trajectory.h"

#include <fstream>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "hands/grasp.h"
#include "tests/pipeline/scratch_folder.h"

namespace geocage::motion {
namespace {

TEST(Trajectory, ReadsBackExactlyAndSpeaksTheContract) {
  TrajectorySet set;
  set.trajectories.resize(2);
  Trajectory& t = set.trajectories[0];
  t.dt_s = 0.1 / 3;
  t.joints = {"a", "b"};
  t.q_rad = {{0.1, 1.0 / 3}, {1e-17, -2}};
  t.X_OH = {geometry::Pose::Identity(),
            hands::file_pose(geometry::Pose(Eigen::Translation3d(1, 2, 1.0 / 3) *
                                            Eigen::AngleAxisd(0.3, geometry::Vec3::UnitX())))};
  t.min_clearance_m = -1e-4;
  t.outcome = "planned";
  t.planner = "aico";
  t.efficiency = {1.5, 2.5, 0.1 / 3, 4, 5};
  t.arm = "kuka_lwr4";
  t.X_OB = t.X_OH[1];
  set.trajectories[1].outcome = "no path: too narrow";

  const tests::ScratchFolder folder;
  save_artefact(set, folder.path());
  TrajectorySet read;
  load_artefact(read, folder.path());
  ASSERT_EQ(read.trajectories.size(), 2u);
  EXPECT_EQ(read.trajectories[0].q_rad, t.q_rad);
  EXPECT_EQ(read.trajectories[0].dt_s, t.dt_s);
  EXPECT_EQ(read.trajectories[0].X_OH[1].matrix(), t.X_OH[1].matrix());
  EXPECT_EQ(read.trajectories[1].outcome, "no path: too narrow");
  EXPECT_EQ(read.trajectories[0].efficiency.effort, 2.5);
  EXPECT_EQ(read.trajectories[0].arm, "kuka_lwr4");
  EXPECT_EQ(read.trajectories[0].X_OB.matrix(), t.X_OB.matrix());

  const auto json = nlohmann::json::parse(std::ifstream(folder / "trajectory_0.json"));
  EXPECT_EQ(json["schema"], "geocage-trajectory 1");
  for (const char* key : {"dt_s", "joints", "q_rad", "X_OH", "min_clearance_m", "certified"})
    EXPECT_TRUE(json.contains(key)) << key;
  EXPECT_EQ(json["certified"], false);
  EXPECT_FALSE(std::filesystem::exists(folder / "trajectory_1.csv"));
}

TEST(Trajectory, TablesAndMessages) {
  Trajectory t;
  t.dt_s = 0.5;
  t.joints = {"a", "b"};
  t.q_rad = {{0, 1}, {0.25, 1}, {0.5, 2}};
  t.X_OH.assign(3, geometry::Pose(Eigen::Translation3d(1, 2, 3)));
  EXPECT_EQ(csv_of(t).substr(0, 45), "time_s,x_m,y_m,z_m,qw,qx,qy,qz,a_rad,b_rad\n0.");
  EXPECT_NE(
      csv_of(t).find(
          "\n0.500000,1.000000000,2.000000000,3.000000000,1.000000000,0.000000000,0.000000000,0.000000000,"
          "0.250000000,1.000000000\n"),
      std::string::npos);
  const auto message = joint_trajectory_of(t);
  EXPECT_NE(message.find("joint_names: [a, b]"), std::string::npos);
  // (0.5 - 0) / 1 s and (2 - 1) / 1 s in the middle, at rest at the ends.
  EXPECT_NE(message.find(
                "positions: [0.250000000, 1.000000000]\n      velocities: [0.500000000, 1.000000000]\n      "
                "time_from_start: {sec: 0, nanosec: 500000000}"),
            std::string::npos);
  EXPECT_NE(message.find("time_from_start: {sec: 1, nanosec: 0}"), std::string::npos);
  EXPECT_NE(message.find("multi_dof_joint_trajectory"), std::string::npos);
  t.arm = "kuka_lwr4";
  EXPECT_EQ(joint_trajectory_of(t).find("multi_dof"), std::string::npos);
}

}  // namespace
}  // namespace geocage::motion
