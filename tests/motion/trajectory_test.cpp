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

  const auto json = nlohmann::json::parse(std::ifstream(folder / "trajectory_0.json"));
  EXPECT_EQ(json["schema"], "geocage-trajectory 1");
  for (const char* key : {"dt_s", "joints", "q_rad", "X_OH", "min_clearance_m", "certified"})
    EXPECT_TRUE(json.contains(key)) << key;
  EXPECT_EQ(json["certified"], false);
}

}  // namespace
}  // namespace geocage::motion
