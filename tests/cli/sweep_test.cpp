// What many items at once promise: no row is lost, one broken item ends nothing, and a second run knows what
// was.
#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/cli/program.h"
#include "tests/cli/shapes_folder.h"

namespace geocage::tests {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

std::string text_of(const fs::path& file) {
  std::ostringstream text;
  text << std::ifstream(file).rdbuf();
  return text.str();
}

/// A bottle and a file that is no mesh, at two levels of friction.
class Sweep : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new ScratchFolder;
    flow_ = quick_flow(*folder_, "[sweep]\n'evaluate.friction' = [0.0, 0.6]\n'scan.seed' = [1]\n");
    set_ = *folder_ / "set";
    fs::create_directories(set_);
    fs::copy_file(*folder_ / "bottle.ply", set_ / "bottle.ply");
    std::ofstream(set_ / "broken.stl") << "solid nothing";
    first_ = run("store", "1");
  }
  static void TearDownTestSuite() { delete folder_; }

  static Ended run(const std::string& store, const std::string& jobs, std::vector<std::string> more = {}) {
    std::vector<std::string> all = {"run",    flow_.string(),      "--dataset", set_.string(),
                                    "--json", "--quiet",           "--store",   (*folder_ / store).string(),
                                    "--out",  out(store).string(), "--jobs",    jobs};
    all.insert(all.end(), more.begin(), more.end());
    return geocage(all);
  }
  static fs::path out(const std::string& store) { return *folder_ / ("out_" + store); }
  static json query(const std::string& statement) {
    const Ended ended = geocage({"query", statement, "--out", out("store").string(), "--json"});
    EXPECT_EQ(ended.code, 0) << ended.err;
    return json::parse(ended.out)["rows"];
  }

  static ScratchFolder* folder_;
  static fs::path flow_, set_;
  static Ended first_;
};
ScratchFolder* Sweep::folder_ = nullptr;
fs::path Sweep::flow_, Sweep::set_;
Ended Sweep::first_;

TEST_F(Sweep, EveryPairHasARowAndRatesForgetNone) {
  ASSERT_EQ(first_.code, 1) << first_.err;
  EXPECT_EQ(json::parse(first_.out)["counts"]["in"], 4);  // 2 objects x 2 levels x 1 seed
  EXPECT_EQ(query("select count(distinct object || variant) from grasps")[0][0], 4);
  EXPECT_EQ(query("select lost_at, held from grasps where object = 'broken'"),
            json::parse(R"([["import",0.0],["import",0.0]])"));
  // a level's rate of best grasps is over 2 objects, the broken one among them
  for (const auto& row :
       query("select trials, objects, wilson_low <= rate, rate <= wilson_high from rates where "
             "measure = 'best grasp held'"))
    EXPECT_EQ(row, json::parse("[2.0, 2.0, 1.0, 1.0]"));
  const json paired = query("select setting, first, other, pairs, objects from paired");
  EXPECT_EQ(paired, json::parse(R"([["evaluate.friction", 0.0, 0.6, 2.0, 2.0]])"));
}

TEST_F(Sweep, TellsAtWhichStageTheBestGraspWasLost) {
  for (const auto& row :
       query("select best_lost_at, held, lost_at from grasps where coalesce(grasp, 0) = 0")) {
    EXPECT_EQ(row[0] == "", row[1] == 1.0) << row;
    EXPECT_TRUE(row[2] == "" || row[0] == row[2]) << row;
  }
  EXPECT_EQ(query("select sum(pairs) from losses")[0][0], 4.0);
  EXPECT_EQ(query("select sum(pairs) from losses where best_lost_at = 'import'")[0][0], 2.0);
  EXPECT_EQ(query("select count(*) from slots where peak_memory_gib > 0 and state = 'made'"),
            query("select count(*) from slots where state = 'made'"));
  const json summary = json::parse(text_of(out("store") / "results.json"));
  EXPECT_EQ(summary["tables"]["rates"]["columns"][0], "measure");
}

TEST_F(Sweep, QueryReadsOnly) {
  const auto code = [&](const std::string& statement) {
    return geocage({"query", statement, "--out", out("store").string()}).code;
  };
  EXPECT_EQ(code("delete from grasps"), 2);
  EXPECT_EQ(code("select 1; select 2"), 2);
  EXPECT_EQ(code("selct"), 2);
  const Ended none = geocage({"query", "select * from nowhere", "--out", out("store").string()});
  for (const char* table : {"grasps", "rates", "paired", "losses", "agreement", "slots"}) {
    EXPECT_NE(none.err.find(table), std::string::npos) << table << ": " << none.err;
    EXPECT_EQ(code(std::string("select count(*) from ") + table), 0) << table;
  }
  EXPECT_EQ(geocage({"query", "select 1", "--out", (*folder_ / "nowhere").string()}).code, 2);
  EXPECT_EQ(geocage({"query", "select 1 as one, 'a,b' as two", "--out", out("store").string(), "--csv"}).out,
            "one,two\n1,\"a,b\"\n");
}

TEST_F(Sweep, LedgerTellsWhatFailedAndItsCommandRepeatsIt) {
  const std::string store = (*folder_ / "store").string();
  const json failures = json::parse(geocage({"failures", "--store", store, "--json"}).out)["failures"];
  ASSERT_EQ(failures.size(), 2u);  // an import for each variant
  EXPECT_EQ(failures[0]["code"], "input");
  EXPECT_EQ(failures[0]["stage"], "import");
  EXPECT_EQ(failures[0]["inputs"].get<std::string>().size(), 64u);
  const std::string command = failures[0]["command"];
  const auto program = command.find(" && geocage ") + 4;
  ASSERT_TRUE(command.starts_with("cd /") && program > 4) << command;
  const std::string repeat = command.substr(0, program) + GEOCAGE_PROGRAM + command.substr(program + 7) +
                             " --quiet > /dev/null 2>&1";
  EXPECT_EQ(WEXITSTATUS(std::system(repeat.c_str())), 1) << command;
}

TEST_F(Sweep, WhatFailedIsNotTriedAgainUnlessAsked) {
  const auto state = [](const Ended& ended) {
    std::vector<std::string> states;
    for (const auto& slot : json::parse(ended.out)["slots"]) states.push_back(slot["state"]);
    return std::ranges::count(states, "made");
  };
  EXPECT_EQ(state(run("store", "1")), 0);
  EXPECT_EQ(state(run("store", "1", {"--retry", "failed"})), 0);
  EXPECT_EQ(run("store", "1", {"--retry", "everything"}).code, 2);
  const json forecast = json::parse(run("store", "1", {"--dry-run"}).out);
  for (const auto& slot : forecast["slots"]) {
    const std::string name = slot["slot"];
    if (name.starts_with("broken") && name.ends_with("/import")) {
      EXPECT_EQ(slot["state"], "failed") << slot;
    }
  }
}

TEST_F(Sweep, DryRunSaysWhatAndWhy) {
  const json late = json::parse(run("store", "1", {"--dry-run", "--set", "evaluate.control_grasps=3"}).out);
  EXPECT_EQ(late["schema"], "geocage-forecast 1");
  int made = 0;
  for (const auto& slot : late["slots"]) {
    if (slot["state"] != "make") continue;
    ++made;
    EXPECT_NE(slot["slot"].get<std::string>().find("/evaluate/"), std::string::npos);
    EXPECT_EQ(slot["reason"], "parameter changed");
  }
  EXPECT_EQ(made, 2);
  const json fresh = json::parse(run("fresh", "1", {"--dry-run"}).out);
  for (const auto& slot : fresh["slots"]) {
    EXPECT_NE(slot["state"], "hit");
    EXPECT_TRUE(slot["state"] != "make" || slot["reason"] == "never made") << slot;
  }
}

TEST_F(Sweep, OneAndTwoJobsGiveTheSameBytesAndTable) {
  run("second", "2");
  EXPECT_EQ(text_of(out("second") / "results.csv"), text_of(out("store") / "results.csv"));
  const auto artefacts = [&](const char* store) {
    std::vector<std::string> names;
    for (const auto& entry : fs::recursive_directory_iterator(*folder_ / store / "artefacts"))
      names.push_back(fs::relative(entry.path(), *folder_ / store));
    std::ranges::sort(names);
    return names;
  };
  EXPECT_EQ(artefacts("second"), artefacts("store"));
}

/// Noise on the true mesh, scores compared with the clean ones; nothing is placed or tested.
TEST(NoiseSweep, ScoresAreComparedWithTheCleanOnes) {
  const ScratchFolder folder;
  quick_flow(folder);
  fs::create_directories(folder / "set");
  fs::rename(folder / "bottle.ply", folder / "set" / "bottle.ply");
  const auto flow = folder / "noise.toml";
  std::ofstream(flow)
      << "objects = ['" << (folder / "set").string() << "']\n"
      << "[scan]\nviews = 2\nwidth = 80\nheight = 60\n[remesh]\nedge_length_m = 0.006\n"
      << "[noise]\nsurface = 'truth'\n[agreement]\nreference = 'clean'\n"
      << "[sweep]\n'noise.sigma_edges' = [0.0, 0.3]\n'noise.seed' = [1, 2]\n'import.scale' = [1, 0.8]\n";
  const Ended ended = geocage({"run", flow.string(), "--until", "agreement", "--quiet", "--store",
                               (folder / "store").string(), "--out", (folder / "out").string()});
  ASSERT_EQ(ended.code, 0) << ended.err << ended.out;
  const auto query = [&](const std::string& statement) {
    const Ended answer = geocage({"query", statement, "--out", (folder / "out").string(), "--json"});
    EXPECT_EQ(answer.code, 0) << answer.err;
    return json::parse(answer.out)["rows"];
  };
  // without noise the scores are the clean ones
  EXPECT_EQ(query("select distinct agreement_curvature_rank_correlation, agreement_curvature_top_overlap, "
                  "agreement_curvature_drift_m from grasps where \"noise.sigma_edges\" = 0"),
            json::parse("[[1.0, 1.0, 0.0]]"));
  for (const auto& row : query("select agreement_curvature_rank_correlation from grasps where "
                               "\"noise.sigma_edges\" > 0")) {
    EXPECT_LT(row[0], 1.0);
    EXPECT_GT(row[0], 0.0);
  }
  EXPECT_EQ(query("select count(*), count(held) from grasps")[0],
            json::parse("[8, 0]"));  // nothing was tested
  EXPECT_EQ(query("select count(*) from rates")[0][0], 0);
  EXPECT_EQ(query("select pairs from agreement where measure = 'curvature_drift_radii'"),
            json::parse("[[2.0], [2.0], [2.0], [2.0]]"));  // two seeds of each level and size
}

TEST(NoiseSweep, ScansHaveNoTruth) {
  const ScratchFolder folder;
  std::ofstream(folder / "scan.xyz") << "0 0 0\n0.1 0 0\n0 0.1 0\n0 0 0.1\n0.1 0.1 0\n";
  const Ended ended =
      geocage({"run", "--object", (folder / "scan.xyz").string(), "--set", "noise.surface=truth", "--json",
               "--quiet", "--store", (folder / "store").string(), "--out", (folder / "out").string()});
  EXPECT_EQ(ended.code, 1) << ended.err;
  EXPECT_EQ(json::parse(ended.out)["counts"]["failed"], 1);
  EXPECT_NE(text_of(folder / "out" / "results.csv").find("a scan has no true surface"), std::string::npos);
}

}  // namespace
}  // namespace geocage::tests
