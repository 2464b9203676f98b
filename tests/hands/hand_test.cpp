#include "hands/hand.h"

#include <fstream>

#include <gtest/gtest.h>

#include "pipeline/error.h"
#include "tests/pipeline/scratch_folder.h"

namespace geocage::hands {
namespace {

namespace fs = std::filesystem;

/// A copy of the SDH's folder whose hand.toml has `from` replaced by `to`.
class HandToml : public testing::Test {
 protected:
  std::string refusal(const std::string& from, const std::string& to) {
    const fs::path folder = scratch_.path() / "changed";
    fs::remove_all(folder);
    fs::copy(source(), folder);
    std::ifstream in(source() / "hand.toml");
    std::string text{std::istreambuf_iterator<char>(in), {}};
    const auto at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    text.replace(at, from.size(), to);
    std::ofstream(folder / "hand.toml") << text;
    try {
      load_hand(folder.string());
    } catch (const pipeline::UserError& error) {
      EXPECT_EQ(error.fault(), pipeline::Fault::configuration);
      return error.what();
    }
    return "accepted";
  }
  static fs::path source() { return fs::path(GEOCAGE_SOURCE_TREE) / "hands/schunk_sdh"; }
  tests::ScratchFolder scratch_;
};

TEST(SchunkSdhHand, CapsulesStayInTheMeasuredBoxesAndFillThem) {
  const Hand hand = load_hand("schunk_sdh");
  EXPECT_EQ(hand.capsules.size(), 16u);
  // hands.md C1, measured boxes in link frames (metres): palm, knuckles, proximal and distal links.
  const auto box_of = [&](const std::string& link) -> std::pair<Vec3, Vec3> {
    if (link == "palm") return {{-0.0662, -0.0611, -0.003}, {0.0471, 0.0611, 0.074}};
    if (link.back() == '1') return {{-0.0225, -0.0225, 0}, {0.0225, 0.0225, 0.0305}};
    if (link.back() == '2') return {{-0.0140, -0.0140, -0.0140}, {0.0153, 0.0140, 0.1005}};
    return {{-0.0140, -0.0139, -0.0140}, {0.0148, 0.0174, 0.0685}};
  };
  Eigen::AlignedBox3d palm;
  for (const Capsule& capsule : hand.capsules) {
    const auto [low, high] = box_of(hand.tree.links[capsule.link]);
    for (const Vec3& end : {capsule.a_L, capsule.b_L}) {
      const Vec3 min = end.array() - capsule.radius_m, max = end.array() + capsule.radius_m;
      EXPECT_TRUE(((min - low).array() > -1e-9).all())
          << hand.tree.links[capsule.link] << " " << min.transpose();
      EXPECT_TRUE(((high - max).array() > -1e-9).all())
          << hand.tree.links[capsule.link] << " " << max.transpose();
      if (capsule.link == 0) palm.extend(min), palm.extend(max);
    }
  }
  EXPECT_LT((palm.min() - Vec3(-0.066, -0.061, -0.003)).cwiseAbs().maxCoeff(), 0.001);
  EXPECT_LT((palm.max() - Vec3(0.047, 0.061, 0.074)).cwiseAbs().maxCoeff(), 0.001);
}

TEST(SchunkSdhHand, SaysWhereItIsOpenAndHowItCloses) {
  const Hand hand = load_hand("schunk_sdh");
  EXPECT_EQ(hand.name, "schunk_sdh");
  ASSERT_EQ(hand.fingers.size(), 3u);
  for (const Finger& finger : hand.fingers) {
    ASSERT_EQ(finger.dofs.size(), 2u);
    EXPECT_EQ(hand.open_rad[finger.dofs[0]], -0.8);
    EXPECT_EQ(hand.open_rad[finger.dofs[1]], 0);
    EXPECT_EQ(hand.closing_rad[finger.dofs[0]], 1);
    for (int i : {0, 1}) EXPECT_EQ(hand.tree.links[finger.links[i]], hand.tree.dof_names[finger.dofs[i]]);
  }
  EXPECT_EQ(hand.closing_rad[hand.tree.dof("knuckle")], 0);
  EXPECT_NEAR(hand.ball_radii_m.back(), 0.155, 1e-15);
  EXPECT_EQ(hand.sha256.size(), 64u);
}

TEST(LoadHand, TakesNamesFoldersAndUrdfs) {
  const fs::path folder = fs::path(GEOCAGE_SOURCE_TREE) / "hands/schunk_sdh";
  const std::string sha256 = load_hand("schunk_sdh").sha256;
  EXPECT_EQ(load_hand(folder.string()).sha256, sha256);
  EXPECT_EQ(load_hand((folder / "schunk_sdh.urdf").string()).sha256, sha256);
  const auto names = hand_names();
  EXPECT_NE(std::find(names.begin(), names.end(), "schunk_sdh"), names.end());
}

TEST(LoadHand, SuggestsTheNearestName) {
  try {
    load_hand("schunk_shd");
    FAIL();
  } catch (const pipeline::UserError& error) {
    EXPECT_EQ(error.fault(), pipeline::Fault::configuration);
    EXPECT_NE(error.hint().find("'schunk_sdh'"), std::string::npos) << error.what();
  }
}

TEST_F(HandToml, ErrorsNameTheLineAndTheKey) {
  EXPECT_EQ(refusal("palm_m", "palm_m"), "accepted");
  const auto expect = [&](const char* from, const char* to, std::initializer_list<const char*> words) {
    const std::string text = refusal(from, to);
    for (const char* word : words)
      EXPECT_NE(text.find(word), std::string::npos) << word << " is not in: " << text;
  };
  expect("palm_m", "plam_m", {"hand.toml:", "'palm_m' is missing"});
  expect("approach = [0.0", "approach = [nan", {"hand.toml:4:", "approach", "finite"});
  expect("flexion_axis = [0.0, 1.0", "flexion_axis = [0.0, 1.0, 1.0] # [", {"hand.toml:5:", "perpendicular"});
  expect("ball_radius_m = 0.06", "ball_radius_m = -1", {"hand.toml:8:", "ball_radius_m"});
  expect("spread_joint = \"knuckle\"", "spread_joint = \"nuckle\"", {"hand.toml:6:", "'knuckle'"});
  expect("urdf = \"schunk_sdh.urdf\"", "urdf = \"sdh.urdf\"", {"sdh.urdf", "can't be read"});
  expect("links = [\"thumb_2\"", "links = [\"thumb_4\"", {"no link 'thumb_4'"});
  expect("open_rad = [-0.8", "open_rad = [-1.8", {"beyond the limits", "finger_12"});
  expect("radius_m = 0.028", "radius_m = 0.028\ncolour = 1", {"unknown key 'colour'"});
  expect("closing = [1, 1]", "closing = [1]", {"one entry for each joint"});
  expect("closing = [1, 1]", "closing = [1, 0]", {"closing", "zero"});
  expect("urdf =", "closing_order = \"later\"\nurdf =", {"closing_order", "breakaway"});
  expect("[[finger]]", "[preshape_rad]\nknuckle = 3.0\n[[finger]]", {"knuckle", "beyond the limits"});
  expect("[[finger]]", "[preshape_rad]\nthumb_2 = 0.0\n[[finger]]", {"thumb_2", "belongs to a finger"});
  expect("[[finger]]", "[preshape_rad]\nknuckel = 0.0\n[[finger]]", {"knuckel", "'knuckle'"});
  expect("links = [\"finger_12\"", "links = [\"palm\"", {"'palm'", "no joint of the finger moves"});
  expect("[[finger]]", "[[finger", {"hand.toml:"});
}

/// Loads a hand.toml that lies alone in a folder named `name`.
Hand load_text(const tests::ScratchFolder& scratch, const std::string& name, const std::string& text) {
  fs::create_directories(scratch / name);
  std::ofstream(scratch / name / "hand.toml") << text;
  return load_hand((scratch / name).string());
}

TEST(LoadHand, TakesANetOfPoints) {
  const Hand net = load_hand("net_of_points");
  ASSERT_TRUE(net.net.has_value());
  EXPECT_EQ(net.net->stretch_share, 0.05);
  EXPECT_EQ(net.tree.dofs(), 0);
  EXPECT_TRUE(net.fingers.empty() && net.capsules.empty());
  std::vector<Pose> X_HL;
  forward_kinematics(net.tree, net.open_rad, X_HL);
  EXPECT_EQ(X_HL.size(), 1u) << "asking where its links are does no harm";
  tests::ScratchFolder scratch;
  EXPECT_THROW(load_text(scratch, "odd",
                         "kind = \"glove\"\nfinger_length_m = 0.1\nball_radius_m = 0.1\n"
                         "ball_radii_of_finger_length = [1.0]\n"),
               pipeline::UserError);
}

TEST(LoadHand, KnowsSpeedsOrdersAndPreshapes) {
  const Hand human = load_hand("human_5f");
  EXPECT_EQ(human.closing_order, ClosingOrder::together);
  for (const Finger& finger : human.fingers) {
    EXPECT_DOUBLE_EQ(human.closing_speed[finger.dofs[1]] / human.closing_speed[finger.dofs[0]], 0.5);
    EXPECT_DOUBLE_EQ(human.closing_speed[finger.dofs[2]] / human.closing_speed[finger.dofs[0]], 0.25);
  }
  const Hand barrett = load_hand("barrett_bh280");
  EXPECT_EQ(barrett.closing_order, ClosingOrder::breakaway);
  for (const Finger& finger : barrett.fingers)
    EXPECT_NEAR(barrett.closing_speed[finger.dofs[1]] / barrett.closing_speed[finger.dofs[0]], 1.0 / 3, 1e-6);
  const Hand allegro = load_hand("allegro");
  const int opposition = allegro.tree.dof("thumb_0");
  EXPECT_EQ(allegro.open_rad[opposition], 1.396) << "opposed, by its preshape";
  EXPECT_EQ(allegro.closing_rad[opposition], 0);
  EXPECT_EQ(load_hand("schunk_sdh").closing_order, ClosingOrder::proximal_first);
}

TEST(LoadHand, MakesVariantsOfAnotherHand) {
  const Hand sdh = load_hand("schunk_sdh");
  tests::ScratchFolder scratch;
  const Hand thin = load_text(scratch, "thin", "base = \"schunk_sdh\"\nfinger_radius_scale = 0.5\n");
  const Hand big = load_text(scratch, "big", "base = \"schunk_sdh\"\nscale = 2.0\nball_radius_m = 0.05\n");
  EXPECT_NE(thin.sha256, sdh.sha256);
  EXPECT_NE(thin.sha256, big.sha256);
  ASSERT_EQ(thin.capsules.size(), sdh.capsules.size());
  EXPECT_EQ(thin.capsules.front().radius_m, sdh.capsules.front().radius_m) << "the palm keeps its shape";
  EXPECT_EQ(thin.capsules.back().radius_m, 0.5 * sdh.capsules.back().radius_m);
  EXPECT_EQ(big.capsules.back().radius_m, 2 * sdh.capsules.back().radius_m);
  EXPECT_EQ(big.ball_radius_m, 2 * 0.05) << "of the variant, before it is scaled";
  std::vector<Pose> X_small, X_big;
  forward_kinematics(sdh.tree, sdh.open_rad, X_small);
  forward_kinematics(big.tree, big.open_rad, X_big);
  for (std::size_t link = 0; link < X_small.size(); ++link) {
    EXPECT_LT((X_big[link].translation() - 2 * X_small[link].translation()).norm(), 1e-15);
    EXPECT_EQ(X_big[link].linear(), X_small[link].linear());
  }
  for (const char* wrong : {"base = \"shunk\"", "base = \"schunk_sdh_thin\"",
                            "base = \"schunk_sdh\"\nscale = 0.0", "base = \"schunk_sdh\"\nwidth = 1.0"})
    EXPECT_THROW(load_text(scratch, "wrong", wrong), pipeline::UserError) << wrong;
}

TEST(LoadHand, ScalesSlidesInMetres) {
  tests::ScratchFolder scratch;
  const Hand gripper = load_hand("parallel_2f"),
             small = load_text(scratch, "small", "base = \"parallel_2f\"\nscale = 0.5\n");
  EXPECT_DOUBLE_EQ(small.tree.upper_rad[0], 0.5 * gripper.tree.upper_rad[0]);
  EXPECT_DOUBLE_EQ(small.tree.joints[1].multiplier, 1) << "its jaws stay coupled one to one";
}

TEST(PlaceCapsules, MovesEndsWithTheirLinks) {
  const Hand hand = load_hand("schunk_sdh");
  std::vector<Pose> X_HL;
  forward_kinematics(hand.tree, Eigen::VectorXd::Zero(7), X_HL);
  Pose X_WH = Pose::Identity();
  X_WH.translation() = Vec3(1, 2, 3);
  std::vector<PlacedCapsule> placed;
  place_capsules(hand, X_WH, X_HL, placed);
  ASSERT_EQ(placed.size(), 16u);
  // The last capsule is the thumb's distal one: straight up from (-0.03811, 0, 0.1775), 55 mm long.
  EXPECT_LT((placed[15].a - Vec3(1 - 0.03811, 2, 3.1775)).norm(), 1e-14);
  EXPECT_LT((placed[15].b - Vec3(1 - 0.03811, 2, 3.2325)).norm(), 1e-14);
}

}  // namespace
}  // namespace geocage::hands
