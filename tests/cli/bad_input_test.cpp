// Bad input gets one clear sentence that names the file, the documented exit code, and leaves nothing
// half-written.
#include <cstdint>
#include <fstream>
#include <limits>
#include <random>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <sys/stat.h>

#include "datasets/shapes.h"
#include "geometry/mesh.h"
#include "hands/grasp.h"
#include "tests/cli/program.h"
#include "tests/pipeline/scratch_folder.h"

namespace geocage::tests {
namespace {

namespace fs = std::filesystem;

class BadInput : public testing::Test {
 protected:
  fs::path write(const std::string& name, const std::string& bytes) const {
    std::ofstream(folder_ / name, std::ios::binary) << bytes;
    return folder_ / name;
  }
  std::string ply_bytes() const {
    geometry::write_ply(folder_ / "good.ply", datasets::icosphere(0.05, 2));
    std::ifstream in(folder_ / "good.ply", std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  static std::string stl_bytes(int triangles, int written) {
    std::string bytes(80, ' ');
    const auto count = static_cast<std::uint32_t>(triangles);
    bytes.append(reinterpret_cast<const char*>(&count), 4);
    return bytes.append(static_cast<std::size_t>(written) * 50, '\x3d');
  }

  /// The sentence that `geocage score` ends with; checks code, name, and that nothing was written.
  std::string refused(const fs::path& mesh, int code = 3) const {
    const fs::path out = folder_ / "scores.csv";
    const Ended ended = geocage({"score", mesh.string(), "--radius-m", "0.02", "--out", out.string()});
    EXPECT_EQ(ended.code, code) << mesh << ": " << ended.err;
    EXPECT_NE(ended.err.find(mesh.filename().string()), std::string::npos) << ended.err;
    EXPECT_NE(ended.err.find(": error: "), std::string::npos) << ended.err;
    EXPECT_EQ(std::count(ended.err.begin(), ended.err.end(), '\n'), 1) << ended.err;
    EXPECT_TRUE(ended.out.empty());
    EXPECT_FALSE(fs::exists(out));
    EXPECT_EQ(ended.err.find("bug"), std::string::npos) << ended.err;
    return ended.err;
  }
  ScratchFolder folder_;
};

// A scene's mistakes are named where they stand, with the page of scenes.
TEST_F(BadInput, Scenes) {
  const auto told = [&](const std::string& scene, int code, const std::string& words) {
    const Ended ended = geocage({"plan", write("scene.toml", scene).string()});
    EXPECT_EQ(ended.code, code) << ended.err;
    EXPECT_NE(ended.err.find(words), std::string::npos) << ended.err;
    EXPECT_EQ(std::count(ended.err.begin(), ended.err.end(), '\n'), 1) << ended.err;
    EXPECT_TRUE(ended.out.empty()) << ended.out;
  };
  const std::string robot = "horizon = 10\n[robot]\nhand = \"schunk_sdh\"\n";
  told("horizon = 10\n[robot\n", 2, "scene.toml:2:7: error: ");
  told("horizon = 10\n[robot]\nhand = \"nohand\"\n", 2, "hand 'nohand': error: there is no such hand");
  told(robot + "[[task]]\nkind = \"dance\"\nprecision = 1\n", 2, "(see docs/planning.md)");
  told(robot + "[[task]]\nkind = \"limits\"\nprecision = nan\n", 2,
       "scene.toml:6:13: error: precision is not finite");
  told(robot + "[[obstacle]]\nshape = \"mesh\"\nfile = \"gone.ply\"\n", 3, "gone.ply: error: ");
  const Ended missing = geocage({"plan", (folder_ / "none.toml").string()});
  EXPECT_EQ(missing.code, 2);
  EXPECT_NE(missing.err.find("none.toml: error: there is no such scene"), std::string::npos) << missing.err;
}

TEST_F(BadInput, MissingFolderEmptyAndPipe) {
  refused(folder_ / "missing.ply");
  fs::create_directory(folder_ / "folder.ply");
  refused(folder_ / "folder.ply");
  refused(write("empty.ply", ""));
  mkfifo((folder_ / "pipe.ply").c_str(), 0600);
  refused(folder_ / "pipe.ply");
}

TEST_F(BadInput, RandomBytes) {
  std::mt19937 random(7);
  std::string bytes(5000, ' ');
  for (char& byte : bytes) byte = static_cast<char>(random());
  for (const char* name : {"noise.ply", "noise.stl", "noise.obj", "noise.off", "noise.glb"})
    refused(write(name, bytes));
}

TEST_F(BadInput, TruncatedPly) {
  const std::string whole = ply_bytes();
  for (int part = 1; part < 8; ++part)
    refused(write("cut.ply", whole.substr(0, whole.size() * static_cast<std::size_t>(part) / 8)));
}

TEST_F(BadInput, TruncatedStl) {
  for (int written : {0, 1, 50, 99}) refused(write("cut.stl", stl_bytes(100, written)));
}

TEST_F(BadInput, CountsThatTheFileCannotHold) {
  refused(write("huge.ply",
                "ply\nformat binary_little_endian 1.0\nelement vertex 4294967295\nproperty float x\n"
                "property float y\nproperty float z\nelement face 4294967295\n"
                "property list uchar int vertex_indices\nend_header\n"));
  refused(write("huge.stl", stl_bytes(2000000000, 2)));
}

TEST_F(BadInput, IndexOutOfRange) {
  refused(
      write("index.ply",
            "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
            "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
            "0 0 0\n0.1 0 0\n0 0.1 0\n3 0 1 77\n"));
  refused(write("index.off", "OFF\n3 1 0\n0 0 0\n0.1 0 0\n0 0.1 0\n3 0 1 77\n"));
}

TEST_F(BadInput, NanVertexIsNamed) {
  auto mesh = datasets::icosphere(0.05, 2);
  mesh.vertices[7].y() = std::numeric_limits<double>::quiet_NaN();
  geometry::write_ply(folder_ / "nan.ply", mesh);
  EXPECT_NE(refused(folder_ / "nan.ply").find("7"), std::string::npos);
}

TEST_F(BadInput, OpenMeshIsRefusedByScoreWithItsFlaw) {
  geometry::write_ply(folder_ / "open.ply", datasets::open_tube(0.03, 0.1, 24, 8));
  EXPECT_NE(refused(folder_ / "open.ply").find("closed"), std::string::npos);
}

TEST_F(BadInput, Polylines) {
  const auto good = write("good.csv", "0,0,0\n1,0,0\n").string();
  for (const char* text : {"", "0,0,0\n", "0,0\n1,1\n", "a,b,c\n", "0,0,0\n1,nan,0\n"}) {
    const Ended ended = geocage({"writhe", write("bad.csv", text).string(), good});
    EXPECT_EQ(ended.code, 3) << text << ended.err;
    EXPECT_NE(ended.err.find("bad.csv"), std::string::npos) << ended.err;
  }
  EXPECT_NE(geocage({"writhe", (folder_ / ".").string(), good}).err.find("not a regular file"),
            std::string::npos);
}

TEST_F(BadInput, FlowFiles) {
  const auto refused_flow = [&](const std::string& toml) {
    const Ended ended =
        geocage({"run", write("flow.toml", toml).string(), "--store", (folder_ / "store").string()});
    EXPECT_EQ(ended.code, 2) << toml << ended.err;
    EXPECT_TRUE(ended.out.empty());
    return ended.err;
  };
  EXPECT_NE(refused_flow("objects = ['mug']\n[remesh]\nsweeps = 0\n")
                .find("flow.toml:3:1: error: [remesh] sweeps: 0 is outside"),
            std::string::npos);
  EXPECT_NE(
      refused_flow("objects = ['mug']\n[remesh]\nedge_lenght_m = 1\n").find("did you mean 'edge_length_m'"),
      std::string::npos);
  EXPECT_NE(refused_flow("objects = ['mug']\n[remsh]\n sweeps = 1\n").find("did you mean 'remesh'"),
            std::string::npos);
  EXPECT_NE(refused_flow("objects = ['mug'\n").find("flow.toml:"), std::string::npos);
  EXPECT_NE(refused_flow("objects = ['mugg']\n").find("did you mean 'mug'"), std::string::npos);
  EXPECT_NE(refused_flow("objcts = ['mug']\n").find("did you mean 'objects'"), std::string::npos);
  EXPECT_NE(refused_flow("objects = ['mug']\nhands = ['schunk_sdf']\n").find("did you mean 'schunk_sdh'"),
            std::string::npos);
  const std::string both = refused_flow("objects = ['mug']\n[remesh]\nsweeps = 0\nmode = 1\n");
  EXPECT_NE(both.find("sweeps"), std::string::npos);
  EXPECT_NE(both.find("mode"), std::string::npos);
  const auto told = [&](const std::string& toml, const std::string& sentence) {
    EXPECT_NE(refused_flow(toml).find(sentence), std::string::npos) << toml;
  };
  told("objects = ['bowl']\n[object.bowll.scan]\nseed = 1\n", "no such object; did you mean 'bowl'?");
  told("objects = ['bowl', 'bowl']\n", "objects: 'bowl' is there twice");
  told("objects = ['bowl']\nhands = []\n", "hands: the list is empty");
  told("objects = ['bowl']\n[sweep]\n'scan.seed' = []\n",
       "flow.toml:3:1: error: [sweep] scan.seed: the list is empty");
  told("objects = ['bowl']\n[sweep]\n'scan.seed' = [1, 1]\n", "scan.seed: '1' is there twice");
  told("objects = ['']\n", "'' is neither an object of the catalogue nor a file");
  std::filesystem::remove_all(folder_ / "store");
  told("objects = ['bowl']\n[sweep]\n'scan.seed' = [1]\n[sweep.scan]\nseed = [2]\n",
       "scan.seed is there twice");
  told("objects = ['bowl']\nhands = ['schunk_sdf']\n", "no such hand");
  told("objects = ['bowl']\n[evaluate]\nobject_geometry = 'truth'\n",
       "flow.toml:3:1: error: [evaluate] object_geometry follows from the object");
  EXPECT_FALSE(std::filesystem::exists(folder_ / "store"));
  EXPECT_EQ(geocage({"run", (folder_ / "none.toml").string(), "--store", (folder_ / "store").string()}).code,
            2);
  EXPECT_EQ(geocage({"run", "--set", "remesh.sweeps=0", "--store", (folder_ / "store").string()}).code, 2);
  EXPECT_EQ(geocage({"run", "--dataset", (folder_ / "none").string()}).code, 2);
}

// A setting that counts for no slot is a mistake; one that counts in one variant of a sweep is none.
TEST_F(BadInput, SettingsThatDoNothing) {
  const auto planned = [&](const std::string& toml) {
    return geocage(
        {"run", write("flow.toml", toml).string(), "--dry-run", "--store", (folder_ / "store").string()});
  };
  const Ended idle = planned("objects = ['bowl']\n[remesh]\nvertices = 900\n[scan]\nbaseline_m = 0.1\n");
  EXPECT_EQ(idle.code, 2);
  EXPECT_NE(
      idle.err.find("flow.toml:3:1: error: [remesh] vertices does nothing: size_by is \"edge_length\", and "
                    "vertices counts with \"vertices\""),
      std::string::npos)
      << idle.err;
  EXPECT_NE(idle.err.find("[scan] baseline_m does nothing: noise is [\"gaussian\"]"), std::string::npos)
      << idle.err;
  const Ended swept = planned(
      "objects = ['bowl']\n[remesh]\nvertices = 900\n[sweep]\n'remesh.size_by' = ['edge_length', "
      "'vertices']\n");
  EXPECT_EQ(swept.code, 0) << swept.err;
}

TEST_F(BadInput, WhatIsViewed) {
  const auto refused = [&](const std::string& name, const std::string& text, const std::string& sentence) {
    std::ofstream(folder_ / name) << text;
    const Ended ended = geocage({"view", (folder_ / name).string(), "--hand", "schunk_sdh", "--json", "--out",
                                 (folder_ / "view").string()});
    EXPECT_EQ(ended.code, 3) << text << ended.err;
    EXPECT_TRUE(ended.out.empty());
    EXPECT_NE(ended.err.find(sentence), std::string::npos) << ended.err;
  };
  refused("schema.json", R"({"schema": 5})", "no schema");
  const std::string way = R"({"schema": "geocage-trajectory 1", )";
  refused("way.json", way + R"("dt_s": 1})", "must be lists");
  refused("way.json", way + R"("dt_s": 1, "joints": ["a"], "q_rad": [], "X_OH": []})", "no steps");
  refused("way.json", way + R"("dt_s": 1, "joints": ["a"], "q_rad": [[]], "X_OH": [{}]})", "each joint");
  refused("way.json", way + R"("dt_s": 1, "joints": ["a"], "q_rad": [[0]], "X_OH": []})", "for each row");
  refused("way.json", way + R"("dt_s": 0, "joints": ["a"], "q_rad": [[0]], "X_OH": [{}]})", "above 0");
  refused("scores.ply",
          "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float winding_angle_rad\n"
          "end_header\n",
          "not as geocage writes them");
}

TEST_F(BadInput, GraspFiles) {
  geometry::write_ply(folder_ / "ball.ply", datasets::icosphere(0.03, 3));
  const auto evaluate = [&](const std::string& hand, const std::string& grasp) {
    return geocage({"evaluate", "--mesh", (folder_ / "ball.ply").string(), "--hand", hand, "--grasp",
                    write("grasp.json", grasp).string()});
  };
  const std::string head = R"({"schema": "geocage-grasp 1", "hand": "schunk_sdh", "object": "ball", )";
  const std::string pose = R"("X_OH": {"p_m": [0, 0, -0.2], "q_wxyz": [1, 0, 0, 0]}, )";
  EXPECT_EQ(evaluate("schunk_sdf", head + pose + R"("joints_rad": {}})").code, 2);
  for (const std::string& bad :
       {std::string("{"), std::string("[]"), std::string(R"({"schema": "other 1"})"),
        head + R"("joints_rad": {}})", head + pose + R"("joints_rad": {"elbow": 1}})",
        head + pose + R"("joints_rad": {"knuckle": 99}})"}) {
    const Ended ended = evaluate("schunk_sdh", bad);
    EXPECT_EQ(ended.code, 3) << bad << ended.err;
    EXPECT_NE(ended.err.find("grasp.json"), std::string::npos) << ended.err;
  }
}

TEST_F(BadInput, WhatIsEvaluated) {
  geometry::write_ply(folder_ / "ball.ply", datasets::icosphere(0.03, 3));
  geometry::write_ply(folder_ / "ball_mm.ply", datasets::icosphere(30, 3));
  const auto hand = hands::load_hand("schunk_sdh");
  hands::Grasp grasp;
  grasp.hand = "schunk_sdh", grasp.object = "ball";
  grasp.joints_rad = hands::joint_map(hand.tree, hand.open_rad);
  const auto evaluate = [&](const char* mesh, const std::string& text) {
    return geocage({"evaluate", "--mesh", (folder_ / mesh).string(), "--hand", "schunk_sdh", "--grasp",
                    write("grasp.json", text).string()});
  };
  const auto says = [](const Ended& ended, const char* words) {
    return (ended.out + ended.err).find(words) != std::string::npos;
  };
  // The ball in the middle of the palm.
  grasp.X_OH.translation() = -(hand.palm_H - 0.02 * hand.approach_H);
  const std::string inside = hands::to_json(grasp).dump();
  const Ended rejected = evaluate("ball.ply", inside);
  EXPECT_EQ(rejected.code, 1) << rejected.err;
  EXPECT_TRUE(says(rejected, "rejected: the hand starts")) << rejected.out;
  // Millimetres: the unit guard asks, and does as it is told.
  const Ended large = evaluate("ball_mm.ply", inside);
  EXPECT_EQ(large.code, 3);
  EXPECT_TRUE(says(large, "--units mm") || says(large, "mm")) << large.err;
  // NaN has no JSON; what writers put in its place is refused by name.
  for (const char* nothing : {"null", "NaN", "1e999"}) {
    std::string text = inside;
    const auto at = text.find("\"p_m\":[") + 7;
    text.replace(at, text.find(',', at) - at, nothing);
    const Ended ended = evaluate("ball.ply", text);
    EXPECT_EQ(ended.code, 3) << text << ended.err;
    EXPECT_TRUE(says(ended, "grasp.json")) << ended.err;
  }
  std::string other = inside;
  other.replace(other.find("schunk_sdh"), 10, "barrett_bh280");
  const Ended mismatched = evaluate("ball.ply", other);
  EXPECT_EQ(mismatched.code, 3) << mismatched.err;
  EXPECT_TRUE(says(mismatched, "--hand barrett_bh280")) << mismatched.err;
  // Numbers that are chosen: in their bounds, not twice, and of geocage's own test alone.
  const auto choosing = [&](const std::vector<std::string>& flags) {
    std::vector<std::string> all = {"evaluate",   "--mesh",  (folder_ / "ball.ply").string(),     "--hand",
                                    "schunk_sdh", "--grasp", write("grasp.json", inside).string()};
    all.insert(all.end(), flags.begin(), flags.end());
    return geocage(all);
  };
  for (const auto& [flags, words] : std::vector<std::pair<std::vector<std::string>, const char*>>{
           {{"--push-m-s2", "0"}, "--push-m-s2"},
           {{"--friction", "nan"}, "--friction"},
           {{"--loads", "axe"}, "--loads"},
           {{"--mass-kg", "1", "--density-kg-m3", "300"}, "--mass-kg"},
           {{"--protocol", "bodex", "--friction", "0.5"}, "only geocage-force takes it"}}) {
    const Ended ended = choosing(flags);
    EXPECT_EQ(ended.code, 2) << words << ended.err;
    EXPECT_TRUE(says(ended, words)) << ended.err;
  }
  const Ended none = evaluate("ball.ply", R"({"schema": "geocage-grasps 1", "grasps": []})");
  EXPECT_EQ(none.code, 3) << none.err;
  EXPECT_TRUE(says(none, "holds no grasp")) << none.err;
}

}  // namespace
}  // namespace geocage::tests
