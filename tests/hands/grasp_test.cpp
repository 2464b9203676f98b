#include "hands/grasp.h"

#include <cmath>
#include <fstream>
#include <random>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "pipeline/error.h"
#include "tests/pipeline/scratch_folder.h"

namespace geocage::hands {
namespace {

double uniform(std::mt19937_64& engine) {
  return static_cast<double>(engine() >> 11) * 0x1p-52 - 1;
}

Pose random_pose(std::mt19937_64& engine) {
  Pose pose = Pose::Identity();
  const Eigen::Vector4d q(uniform(engine), uniform(engine), uniform(engine), uniform(engine));
  pose.linear() = Eigen::Quaterniond(q.normalized()).toRotationMatrix();
  pose.translation() = Vec3(uniform(engine), uniform(engine), uniform(engine));
  return pose;
}

Grasp sample(std::mt19937_64& engine) {
  Grasp grasp{.hand = "schunk_sdh", .object = "mug", .heuristic = "winding"};
  grasp.X_OH = file_pose(random_pose(engine));
  const Hand hand = load_hand("schunk_sdh");
  grasp.joints_rad = joint_map(hand.tree, hand.open_rad);
  grasp.pregrasp_joints_rad = joint_map(hand.tree, 0.1 * hand.open_rad);
  grasp.scores = {{"blocked_share", 1.0 / 3}, {"winding_angle_rad", std::nan("")}};
  return grasp;
}

std::string bytes_of(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

TEST(FilePose, ComesBackFromItsFileBitByBit) {
  std::mt19937_64 engine(3);
  for (int trial = 0; trial < 20000; ++trial) {
    const Pose pose = random_pose(engine), canonical = file_pose(pose);
    // Four quaternion components rounded at 5e-13 turn the pose by at most 2e-12 rad.
    EXPECT_LT((pose.matrix() - canonical.matrix()).norm(), 1e-11);
    const Pose read = pose_from_json(nlohmann::json::parse(to_json(canonical).dump()), "test");
    ASSERT_EQ(read.matrix(), canonical.matrix());
  }
}

TEST(GraspSet, SavesAndLoadsExactly) {
  std::mt19937_64 engine(7);
  const GraspSet set{{sample(engine), sample(engine)}, {{"support", 12}, {"fingers", 3}}};
  const tests::ScratchFolder first, second;
  save_artefact(set, first.path());
  GraspSet read;
  load_artefact(read, first.path());
  ASSERT_EQ(read.grasps.size(), 2u);
  EXPECT_EQ(read.rejected, set.rejected);
  for (int i : {0, 1}) {
    EXPECT_EQ(read.grasps[i].X_OH.matrix(), set.grasps[i].X_OH.matrix());
    EXPECT_EQ(read.grasps[i].joints_rad, set.grasps[i].joints_rad);
    EXPECT_EQ(read.grasps[i].heuristic, "winding");
    EXPECT_EQ(read.grasps[i].scores.at("blocked_share"), 1.0 / 3);
    EXPECT_TRUE(std::isnan(read.grasps[i].scores.at("winding_angle_rad")));
  }
  save_artefact(read, second.path());
  for (const char* file : {"grasps.json", "rejected.json"})
    EXPECT_EQ(bytes_of(first.path() / file), bytes_of(second.path() / file));
}

TEST(GraspFile, KeepsTheContract) {
  std::mt19937_64 engine(9);
  const nlohmann::json object = to_json(sample(engine));
  EXPECT_EQ(object["schema"], "geocage-grasp 1");
  for (const char* key : {"hand", "object", "X_OH", "joints_rad", "pregrasp_joints_rad", "scores"})
    EXPECT_TRUE(object.contains(key)) << key;
  EXPECT_EQ(object["X_OH"]["p_m"].size(), 3u);
  EXPECT_EQ(object["X_OH"]["q_wxyz"].size(), 4u);
  EXPECT_TRUE(object["scores"]["winding_angle_rad"].is_null());
}

TEST(GraspFile, ReadsOneGraspOrAList) {
  std::mt19937_64 engine(11);
  const tests::ScratchFolder scratch;
  const auto file = scratch.path() / "g.json";
  std::ofstream(file) << to_json(sample(engine));
  EXPECT_EQ(read_grasps(file).grasps.size(), 1u);
  std::ofstream(file) << nlohmann::json{{"schema", "geocage-grasps 1"}, {"grasps", nlohmann::json::array()}};
  EXPECT_EQ(read_grasps(file).grasps.size(), 0u);
}

TEST(GraspFile, RefusesByFileAndKey) {
  std::mt19937_64 engine(13);
  const nlohmann::json good = to_json(sample(engine));
  const auto expect = [&](const char* patch, std::initializer_list<const char*> words) {
    try {
      grasp_from_json(good.patch(nlohmann::json::parse(patch)), "g.json");
      ADD_FAILURE() << "accepted " << patch;
    } catch (const pipeline::UserError& error) {
      EXPECT_EQ(error.fault(), pipeline::Fault::input);
      for (const std::string word : words)
        EXPECT_NE(std::string(error.what()).find(word), std::string::npos)
            << word << " is not in: " << error.what();
    }
  };
  expect(R"([{"op": "remove", "path": "/schema"}])", {"g.json", "schema"});
  expect(R"([{"op": "replace", "path": "/schema", "value": "geocage-grasp 9"}])", {"geocage-grasp 9"});
  expect(R"([{"op": "remove", "path": "/X_OH/p_m"}])", {"X_OH", "p_m"});
  expect(R"([{"op": "replace", "path": "/X_OH/p_m", "value": [1, 2]}])", {"p_m", "3 numbers"});
  expect(R"([{"op": "replace", "path": "/X_OH/p_m/1", "value": null}])", {"p_m", "finite"});
  expect(R"([{"op": "replace", "path": "/X_OH/q_wxyz", "value": [2, 0, 0, 0]}])", {"q_wxyz", "unit"});
  expect(R"([{"op": "replace", "path": "/joints_rad/knuckle", "value": "x"}])", {"joints_rad.knuckle"});
  expect(R"([{"op": "remove", "path": "/joints_rad"}])", {"joints_rad"});
  expect(R"([{"op": "add", "path": "/points_m", "value": []}])", {"points_m"});
  expect(R"([{"op": "add", "path": "/points_m", "value": [[0, 1]]}])", {"points_m[0]", "3 numbers"});
  const tests::ScratchFolder scratch;
  std::ofstream(scratch.path() / "g.json") << "{\"schema\": ";
  EXPECT_THROW(read_grasps(scratch.path() / "g.json"), pipeline::UserError);
  EXPECT_THROW(read_grasps(scratch.path()), pipeline::UserError);
  std::ofstream(scratch.path() / "list.json") << "[1, 2]";
  EXPECT_THROW(read_grasps(scratch.path() / "list.json"), pipeline::UserError);
}

TEST(JointVector, RefusesWhatTheHandHasNot) {
  const Hand hand = load_hand("schunk_sdh");
  auto joints = joint_map(hand.tree, hand.open_rad);
  EXPECT_EQ(joint_vector(hand.tree, joints, "g"), hand.open_rad);
  joints["knuckle"] = 1.5708 + 1e-7;
  EXPECT_EQ(joint_vector(hand.tree, joints, "g")[hand.tree.dof("knuckle")], 1.5708)
      << "within the slack: clamped";
  for (double bad : {1.6, -0.1, std::nan("")}) {
    joints["knuckle"] = bad;
    EXPECT_THROW(joint_vector(hand.tree, joints, "g"), pipeline::UserError);
  }
  joints["knuckle"] = 0;
  joints["finger_21"] = 0;
  EXPECT_THROW(joint_vector(hand.tree, joints, "g"), pipeline::UserError)
      << "a mimic joint is not independent";
  joints.erase("finger_21");
  joints.erase("thumb_2");
  EXPECT_THROW(joint_vector(hand.tree, joints, "g"), pipeline::UserError);
}

}  // namespace
}  // namespace geocage::hands
