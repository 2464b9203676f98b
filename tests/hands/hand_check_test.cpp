#include "hands/hand_check.h"

#include <fstream>

#include <gtest/gtest.h>

#include "hands/urdf_mesh.h"
#include "pipeline/error.h"
#include "tests/pipeline/scratch_folder.h"

namespace geocage::hands {
namespace {

namespace fs = std::filesystem;

std::string all_of(const std::vector<std::string>& sentences) {
  std::string text;
  for (const auto& sentence : sentences) text += sentence + "\n";
  return text;
}

TEST(CheckHand, NamesWhatIsMissing) {
  Hand hand = load_hand("schunk_sdh");
  EXPECT_TRUE(check_hand(hand).problems.empty());
  hand.tree.effort_limit_nm[hand.tree.dof("thumb_2")] = 0;
  hand.tree.velocity_limit_rad_s[hand.tree.dof("finger_12")] = 0;
  std::erase_if(hand.capsules,
                [&](const Capsule& c) { return hand.tree.links[c.link].starts_with("finger_2"); });
  const std::string text = all_of(check_hand(hand).problems);
  for (const char* words : {"joint 'thumb_2' has no effort", "joint 'finger_12' has no velocity",
                            "finger 'finger_2' has no capsule"})
    EXPECT_NE(text.find(words), std::string::npos) << words << " is not in: " << text;
}

TEST(CheckHand, SeesAFingerThatClosesTheWrongWay) {
  Hand hand = load_hand("schunk_sdh");
  for (int dof : hand.fingers[2].dofs) hand.closing_rad[dof] *= -1;
  const auto problems = check_hand(hand).problems;
  ASSERT_EQ(problems.size(), 1u);
  EXPECT_NE(problems[0].find("'thumb' comes no nearer"), std::string::npos) << problems[0];
}

TEST(CheckHand, NotesLinksThatOverlap) {
  Hand hand = load_hand("schunk_sdh");
  hand.open_rad[hand.tree.dof("knuckle")] = 0.6;  // the two fingers lean into each other
  hand.open_rad[hand.tree.dof("finger_12")] = 1.2;
  hand.open_rad[hand.tree.dof("finger_22")] = 1.2;
  EXPECT_NE(all_of(check_hand(hand).notes).find("overlap"), std::string::npos);
}

/// A hand of one link whose mesh is a cube of `side` file units, with `scale` in the URDF.
class MeshHand : public testing::Test {
 protected:
  void SetUp() override { fs::create_directories(scratch_.path() / "robot_description/urdf"); }

  fs::path urdf(const std::string& uri, const std::string& scale, const std::string& origin = "0 0 0") {
    const fs::path file = scratch_.path() / "robot_description/urdf/hand.urdf";
    std::ofstream(file) << "<robot name='r'><link name='a'><collision><origin xyz='" << origin
                        << "'/><geometry><mesh filename='" << uri << "' scale='" << scale
                        << "'/></geometry></collision></link></robot>";
    return file;
  }
  static void write_cube(const fs::path& file, double side) {
    fs::create_directories(file.parent_path());
    std::ofstream out(file);
    for (int corner = 0; corner < 8; ++corner)
      out << "v " << side * (corner & 1) << " " << side * (corner >> 1 & 1) << " " << side * (corner >> 2)
          << "\n";
    for (const char* face : {"1 3 4 2", "5 6 8 7", "1 2 6 5", "3 7 8 4", "1 5 7 3", "2 4 8 6"})
      out << "f " << face << "\n";
  }
  std::string refusal(const fs::path& file) {
    try {
      read_urdf(file);
    } catch (const pipeline::UserError& error) {
      EXPECT_EQ(error.fault(), pipeline::Fault::configuration);
      return error.what();
    }
    return "accepted";
  }
  tests::ScratchFolder scratch_;
};

TEST_F(MeshHand, MeshesAreScaledAndMoved) {
  write_cube(scratch_.path() / "robot_description/meshes/cube.obj", 20);
  for (const char* uri : {"package://robot_description/meshes/cube.obj", "../meshes/cube.obj"})
    for (const char* scale : {"0.001 0.001 0.001", "-0.001 0.001 0.001"}) {
      const KinematicTree tree = read_urdf(urdf(uri, scale, "0.1 0 0"));
      ASSERT_EQ(tree.meshes.size(), 1u);
      const auto report = geometry::check_mesh(read_link_mesh(tree.meshes[0]));
      // 20 mm in a file of millimetres, one corner at the origin of M; a mirror keeps the outside outside.
      EXPECT_NEAR(report.volume_m3, 8e-6, 1e-12);
      EXPECT_NEAR(report.box_max.y(), 0.02, 1e-9);
      EXPECT_NEAR(report.box_max.x(), scale[0] == '-' ? 0.1 : 0.12, 1e-9);
    }
}

TEST_F(MeshHand, PackagesAreSoughtInTheEnvironment) {
  const fs::path elsewhere = scratch_.path() / "share";
  write_cube(elsewhere / "other_description/cube.obj", 0.02);
  const fs::path file = urdf("package://other_description/cube.obj", "1 1 1");
  EXPECT_NE(refusal(file).find("GEOCAGE_PACKAGE_PATH"), std::string::npos);
  for (const fs::path& path : {elsewhere, elsewhere / "other_description"}) {
    setenv("GEOCAGE_PACKAGE_PATH", ("/no/such/folder:" + path.string()).c_str(), 1);
    EXPECT_EQ(refusal(file), "accepted");
  }
  unsetenv("GEOCAGE_PACKAGE_PATH");
}

TEST_F(MeshHand, AMissingMeshIsRefusedByName) {
  for (const char* uri :
       {"cube.obj", "/no/such/cube.obj", "package://nobody/cube.obj", "http://x/cube.obj"}) {
    const std::string text = refusal(urdf(uri, "1 1 1"));
    EXPECT_NE(text.find("link 'a'"), std::string::npos) << text;
    EXPECT_NE(text.find(std::string("'") + uri + "'"), std::string::npos) << text;
  }
}

TEST_F(MeshHand, ChecksMeshesAgainstCapsules) {
  write_cube(scratch_.path() / "robot_description/meshes/cube.obj", 20);
  Hand hand = load_hand("schunk_sdh");
  hand.tree.meshes = read_urdf(urdf("../meshes/cube.obj", "0.001 0.001 0.001", "0.2 0 0")).meshes;
  EXPECT_NE(all_of(check_hand(hand).notes).find("sticks out"), std::string::npos);
}

TEST(DraftHandToml, LoadsOnceItIsWritten) {
  tests::ScratchFolder scratch;
  const fs::path source = fs::path(GEOCAGE_SOURCE_TREE) / "hands/schunk_sdh/schunk_sdh.urdf";
  fs::create_directory(scratch / "mine");
  fs::copy(source, scratch.path() / "mine/schunk_sdh.urdf");
  std::ofstream(scratch.path() / "mine/hand.toml") << draft_hand_toml(read_urdf(source), "schunk_sdh.urdf");
  const Hand hand = load_hand((scratch / "mine").string());
  ASSERT_EQ(hand.fingers.size(), 3u);
  EXPECT_EQ(hand.fingers[2].name, "thumb_3");
  EXPECT_EQ(hand.fingers[2].dofs.size(), 2u);
  EXPECT_EQ(hand.capsules.size(), 12u) << "one a link, and one from the palm to each of its three children";
}

}  // namespace
}  // namespace geocage::hands
