// A scene file yields several objects in one run.
#include <fstream>
#include <map>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "datasets/shapes.h"
#include "tests/cli/program.h"
#include "tests/pipeline/scratch_folder.h"

namespace geocage::tests {
namespace {

namespace fs = std::filesystem;
using geometry::Vec3;
using nlohmann::json;

class SceneRun : public testing::Test {
 protected:
  void SetUp() override {
    fs::create_directory(folder_ / "data");
    std::ofstream out(folder_ / "data" / "desk.xyz");
    for (int x = -100; x <= 100; ++x)
      for (int y = -100; y <= 100; ++y) out << x * 0.002 << " " << y * 0.002 << " -0.9\n";
    for (const auto& [radius, at] : {std::pair{0.05, Vec3(0.1, 0, -0.85)}, {0.03, Vec3(-0.1, 0.05, -0.87)}})
      for (const Vec3& p : datasets::icosphere(radius, 4).vertices) out << (p + at).transpose() << "\n";
  }
  Ended run(std::vector<std::string> more) const {
    std::vector<std::string> all = {more.front(),
                                    "--dataset",
                                    (folder_ / "data").string(),
                                    "--store",
                                    (folder_ / "store").string(),
                                    "--hand",
                                    "schunk_sdh",
                                    "--json",
                                    "--quiet"};
    all.insert(all.begin() + 1, more.begin() + 1, more.end());
    return geocage(all);
  }
  static std::map<std::string, std::string> states(const Ended& ended) {
    std::map<std::string, std::string> found;
    const json answer = json::parse(ended.out);
    for (const auto& slot : answer["slots"]) found[slot["slot"]] = slot["state"];
    return found;
  }
  ScratchFolder folder_;
};

TEST_F(SceneRun, EveryObjectIsAnObjectOfTheRun) {
  const Ended first = run({"run", "--set", "import.scene=table", "--until", "cloud"});
  ASSERT_EQ(first.code, 0) << first.err;
  EXPECT_EQ(json::parse(first.out)["counts"]["in"], 2);
  auto found = states(first);
  for (const char* slot : {"desk/scene", "desk.0/import", "desk.0/cloud", "desk.1/import", "desk.1/cloud"})
    EXPECT_TRUE(found.contains(slot)) << slot;
  for (const auto& [slot, state] : states(run({"run", "--set", "import.scene=table", "--until", "cloud"})))
    EXPECT_EQ(state, "hit") << slot;

  found = states(run({"status", "--set", "import.scene=table"}));
  EXPECT_EQ(found["desk/scene"], "hit");
  EXPECT_EQ(found["desk.1/cloud"], "hit");
  EXPECT_EQ(found["desk.1/reconstruct"], "miss");
  EXPECT_NE(run({"why", "desk.1/cloud", "--set", "import.scene=table", "--set", "cloud.voxel_m=0.003"})
                .out.find("voxel_m"),
            std::string::npos);
  EXPECT_NE(run({"graph", "--set", "import.scene=table"}).out.find("desk/scene"), std::string::npos);
}

TEST_F(SceneRun, OneObjectMayBeChosen) {
  const auto chosen = [&](std::vector<std::string> more) {
    more.insert(more.begin(), {"run", "--until", "import", "--set", "import.scene=table"});
    return run(more);
  };
  EXPECT_TRUE(states(chosen({"--object", "desk.1"})).contains("desk.1/import"));
  EXPECT_FALSE(states(chosen({"--object", "desk.1"})).contains("desk.0/import"));
  EXPECT_TRUE(states(chosen({"--set", "import.cluster=1"})).contains("desk/import"));
  EXPECT_EQ(json::parse(chosen({"--object", "desk"}).out)["counts"]["in"], 2);
  const Ended none = chosen({"--object", "desk.7"});
  EXPECT_EQ(none.code, 2) << none.err;
  EXPECT_NE(none.err.find("no such object"), std::string::npos) << none.err;
}

TEST_F(SceneRun, ASceneThatCannotBeReadIsOneFailedItem) {
  std::ofstream(folder_ / "data" / "broken.pcd") << "la la la";
  const Ended ended = run({"run", "--set", "import.scene=table", "--until", "cloud"});
  EXPECT_EQ(ended.code, 1) << ended.err;
  const json counts = json::parse(ended.out)["counts"];
  EXPECT_EQ(counts["in"], 3);
  EXPECT_EQ(counts["failed"], 1);
  EXPECT_EQ(run({"status", "--set", "import.scene=table"}).code, 0);
}

}  // namespace
}  // namespace geocage::tests
