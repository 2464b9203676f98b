// Sentences of docs/architecture.md, section 4, about runs, on a bottle that takes seconds.
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "hands/grasp.h"
#include "pipeline/store.h"
#include "tests/cli/program.h"
#include "tests/cli/shapes_folder.h"

namespace geocage::tests {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

std::map<std::string, std::string> states_of(const json& run) {
  std::map<std::string, std::string> states;
  for (const auto& slot : run["slots"]) states[slot["slot"]] = slot["state"];
  return states;
}

std::map<std::string, std::string> contents_of(const json& run) {
  std::map<std::string, std::string> contents;
  for (const auto& slot : run["slots"])
    contents[slot["slot"]] = fs::path(slot["folder"].get<std::string>()).filename();
  return contents;
}

int made(const json& run) {
  int count = 0;
  for (const auto& slot : run["slots"]) count += slot["state"] == "made";
  return count;
}

/// One cold run, shared by the tests that only look at what it made.
class FlowRun : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new ScratchFolder;
    flow_ = quick_flow(*folder_);
    first_ = geocage(arguments(flow_));
  }
  static void TearDownTestSuite() { delete folder_; }

  static std::vector<std::string> arguments(const fs::path& flow, std::vector<std::string> more = {},
                                            const std::string& store = "store") {
    std::vector<std::string> all = {"run",     flow.string(),
                                    "--json",  "--quiet",
                                    "--store", (*folder_ / store).string(),
                                    "--out",   (*folder_ / "report").string()};
    all.insert(all.end(), more.begin(), more.end());
    return all;
  }
  static json run(const std::vector<std::string>& more = {}, const fs::path& flow = flow_) {
    return json::parse(geocage(arguments(flow, more)).out);
  }

  static ScratchFolder* folder_;
  static fs::path flow_;
  static Ended first_;
};
ScratchFolder* FlowRun::folder_ = nullptr;
fs::path FlowRun::flow_;
Ended FlowRun::first_;

TEST_F(FlowRun, JsonIsOneDocumentAndCountsAddUp) {
  ASSERT_EQ(first_.code, 0) << first_.err << first_.out;
  EXPECT_TRUE(first_.err.empty()) << first_.err;  // --quiet
  const json answer = json::parse(first_.out);
  EXPECT_EQ(answer["schema"], "geocage-run 1");
  const json& c = answer["counts"];
  EXPECT_EQ(c["in"], 1);
  EXPECT_EQ(c["in"].get<int>(), c["done"].get<int>() + c["failed"].get<int>() + c["rejected"].get<int>() +
                                    c["skipped"].get<int>());
  EXPECT_TRUE(fs::exists(answer["report"].get<std::string>()));
  for (const auto& slot : answer["slots"]) {
    EXPECT_EQ(slot["state"], "made");
    EXPECT_TRUE(fs::is_directory(slot["folder"].get<std::string>()));
  }
}

TEST_F(FlowRun, SlotsAreNamedAsTheContractSays) {
  const auto states = states_of(json::parse(first_.out));
  for (const char* slot : {"bottle/import", "bottle/scan", "bottle/cloud", "bottle/occupancy",
                           "bottle/clearance", "bottle/reconstruct", "bottle/remesh", "bottle/field",
                           "bottle/balls/schunk_sdh", "bottle/score/schunk_sdh", "bottle/place/schunk_sdh",
                           "bottle/approach/schunk_sdh", "bottle/evaluate/schunk_sdh"})
    EXPECT_TRUE(states.contains(slot)) << slot;
}

TEST_F(FlowRun, SecondRunMakesNothing) {
  const json second = run();
  EXPECT_EQ(made(second), 0);
  EXPECT_EQ(contents_of(second), contents_of(json::parse(first_.out)));
}

TEST_F(FlowRun, CommentsAndOrderOfKeysMakeNothing) {
  const auto other = *folder_ / "other.toml";
  std::ofstream(other) << "# another comment\nhands = ['schunk_sdh']\nobjects = ['"
                       << (*folder_ / "bottle.ply").string()
                       << "']\n[place]\nmax_grasps = 2\n[field]\ncells = 32\n[remesh]\nedge_length_m = 6e-3\n"
                       << "[scan]\nheight = 120\nwidth = 160\nviews = 4\n";
  EXPECT_EQ(made(run({}, other)), 0);
}

TEST_F(FlowRun, LateParameterRemakesOnlyItsStage) {
  const auto why = geocage({"why", "bottle/evaluate/schunk_sdh", flow_.string(), "--store",
                            (*folder_ / "store").string(), "--set", "evaluate.friction=0.5"});
  EXPECT_NE(why.out.find("- param friction = 0.6"), std::string::npos) << why.out;
  EXPECT_NE(why.out.find("+ param friction = 0.5"), std::string::npos) << why.out;
  const auto states = states_of(run({"--set", "evaluate.friction=0.5"}));
  for (const auto& [slot, state] : states)
    EXPECT_EQ(state, slot == "bottle/evaluate/schunk_sdh" ? "made" : "hit") << slot;
}

TEST_F(FlowRun, OnlyUntilAndForce) {
  EXPECT_EQ(states_of(run({"--only", "bottle/remesh"})),
            (std::map<std::string, std::string>{{"bottle/remesh", "hit"}}));
  EXPECT_FALSE(states_of(run({"--until", "bottle/cloud"})).contains("bottle/remesh"));
  const json forced = run({"--force", "bottle/remesh"});
  EXPECT_EQ(made(forced), 1);  // the same bytes again: nothing after it is made
  EXPECT_EQ(contents_of(forced), contents_of(run()));
  EXPECT_EQ(geocage(arguments(flow_, {"--only", "bottle/remsh"})).code, 2);
}

TEST_F(FlowRun, StatusShowGraphVerify) {
  const std::string store = (*folder_ / "store").string();
  const json status = json::parse(geocage({"status", flow_.string(), "--store", store, "--json"}).out);
  for (const auto& slot : status["slots"]) EXPECT_EQ(slot["state"], "hit");
  const Ended fresh = geocage({"status", flow_.string(), "--store", (*folder_ / "fresh").string()});
  EXPECT_NE(fresh.out.find("miss bottle/import"), std::string::npos) << fresh.out;
  EXPECT_NE(fresh.out.find("?    bottle/remesh"), std::string::npos) << fresh.out;
  const json shown = json::parse(geocage({"show", "bottle/remesh", "--store", store, "--json"}).out);
  EXPECT_TRUE(shown["files"].contains("mesh.ply"));
  EXPECT_NE(geocage({"graph", flow_.string(), "--store", store})
                .out.find("\"bottle/cloud\" -> \"bottle/reconstruct\""),
            std::string::npos);
  EXPECT_EQ(geocage({"verify", "--store", store}).code, 0);
}

TEST_F(FlowRun, ArtefactsOpenInCommonTools) {
  const json answer = json::parse(first_.out);
  std::map<std::string, fs::path> folder;
  for (const auto& slot : answer["slots"]) folder[slot["slot"]] = slot["folder"].get<std::string>();
  const auto first_line = [](const fs::path& file) {
    std::string line;
    std::getline(std::ifstream(file), line);
    return line;
  };
  // assimp reads both, and finds the closed surface that was written
  for (const char* file : {"bottle/remesh mesh.ply", "bottle/score/schunk_sdh scores.ply"}) {
    const std::string both = file;
    const auto gap = both.find(' ');
    const fs::path path = folder[both.substr(0, gap)] / both.substr(gap + 1);
    const Ended scored = geocage({"score", path.string(), "--radius-m", "0.02"});
    EXPECT_EQ(scored.code, 0) << path << scored.err;
  }
  for (const auto& [slot, at] : folder)
    for (const auto& file : fs::directory_iterator(at))
      if (file.path().extension() == ".json") {
        EXPECT_EQ(std::system(("python3 -m json.tool '" + file.path().string() + "' > /dev/null").c_str()), 0)
            << file;
      }
  EXPECT_TRUE(first_line(folder["bottle/field"] / "coarse.nrrd").starts_with("NRRD"));
  EXPECT_EQ(first_line(folder["bottle/occupancy"] / "occupancy.bt"), "# Octomap OcTree binary file");
  const auto grasps = hands::read_grasps(folder["bottle/place/schunk_sdh"] / "grasps.json");
  EXPECT_FALSE(grasps.grasps.empty());
}

TEST_F(FlowRun, AFolderThatShowedSomethingElseShowsTheRunAgain) {
  const auto title = [] {
    std::string page;
    std::getline(std::ifstream(*folder_ / "report" / "index.html"), page, '\0');
    return page.substr(page.find("<title>") + 7, 4);
  };
  run();
  ASSERT_EQ(title(), "flow");
  const Ended view =
      geocage({"view", (*folder_ / "bottle.ply").string(), "--out", (*folder_ / "report").string()});
  ASSERT_EQ(view.code, 0) << view.err;
  run();
  EXPECT_EQ(title(), "flow");
}

// What is not its own a report leaves alone, and of what is its own nothing that is no longer shown is left.
TEST_F(FlowRun, AReportRemovesNothingButItsOwn) {
  const fs::path folder = *folder_ / "mine";
  for (const char* name : {"data", "pictures", "ways/1", "viewer"}) {
    fs::create_directories(folder / name);
    std::ofstream(folder / name / "small-mine.js") << "mine";
  }
  const auto written = [&](const std::vector<std::string>& words) {
    std::vector<std::string> all = words;
    all.insert(all.end(), {"--out", folder.string()});
    const Ended ended = geocage(all);
    ASSERT_EQ(ended.code, 0) << ended.err;
    for (const char* name : {"data", "pictures", "ways/1", "viewer"})
      EXPECT_TRUE(fs::exists(folder / name / "small-mine.js")) << name;
    if (!fs::exists(folder / "viewer" / "files.txt")) return;  // the pages' scripts were not built
    std::set<std::string> listed;
    std::ifstream list(folder / "viewer" / "files.txt");
    for (std::string name; std::getline(list, name);) listed.insert(name);
    for (const auto& file : fs::directory_iterator(folder / "data")) {
      const std::string name = file.path().filename();
      EXPECT_TRUE(name == "small-mine.js" || listed.contains("data/" + name)) << name;
    }
  };
  written({"report", flow_.string(), "--store", (*folder_ / "store").string()});
  written({"view", (*folder_ / "bottle.ply").string()});
}

TEST_F(FlowRun, AFolderThatCannotBeIsToldBeforeAnythingIsMade) {
  const std::string store = (*folder_ / "unused").string();
  const Ended ended = geocage({"run", flow_.string(), "--json", "--store", store, "--out", flow_.string()});
  EXPECT_EQ(ended.code, 5);
  EXPECT_TRUE(ended.out.empty());
  EXPECT_TRUE(fs::is_empty(fs::path(store) / "records"));
}

TEST_F(FlowRun, AGraspOfTheRunIsEvaluatedFromItsFile) {
  const json answer = json::parse(first_.out);
  fs::path place;
  for (const auto& slot : answer["slots"])
    if (slot["slot"] == "bottle/place/schunk_sdh") place = slot["folder"].get<std::string>();
  const auto grasps = hands::read_grasps(place / "grasps.json");
  ASSERT_FALSE(grasps.grasps.empty());
  std::ofstream(*folder_ / "one.json") << hands::to_json(grasps.grasps.front()).dump();
  const Ended ended = geocage({"evaluate", "--mesh", (*folder_ / "bottle.ply").string(), "--hand",
                               "schunk_sdh", "--grasp", (*folder_ / "one.json").string(), "--push-m-s2", "5",
                               "--density-kg-m3", "300", "--friction", "0.5", "--json"});
  const json evaluation = json::parse(ended.out);
  EXPECT_EQ(evaluation["engine"]["acceleration_m_s2"], 5);
  EXPECT_EQ(evaluation["engine"]["density_kg_m3"], 300);
  EXPECT_EQ(evaluation["engine"]["mu"], 0.5);
  EXPECT_EQ(evaluation["schema"], "geocage-evaluation 1");
  EXPECT_EQ(evaluation["protocol"], "geocage-force");
  if (evaluation["outcome"] == "held" || evaluation["outcome"] == "lost") {
    ASSERT_EQ(evaluation["directions"].size(), 6u);
    EXPECT_EQ(evaluation["directions"][0]["name"], "+x");
  }
  EXPECT_TRUE(evaluation["engine"].contains("dt_s"));
}

TEST_F(FlowRun, AGraspIsJudgedByEveryProtocolSideBySide) {
  const json answer = json::parse(first_.out);
  fs::path place;
  for (const auto& slot : answer["slots"])
    if (slot["slot"] == "bottle/place/schunk_sdh") place = slot["folder"].get<std::string>();
  const auto grasps = hands::read_grasps(place / "grasps.json");
  std::ofstream(*folder_ / "first.json") << hands::to_json(grasps.grasps.front()).dump();
  const auto evaluate = [&](const std::string& protocol) {
    return geocage({"evaluate", "--mesh", (*folder_ / "bottle.ply").string(), "--hand", "schunk_sdh",
                    "--grasp", (*folder_ / "first.json").string(), "--protocol", protocol, "--json"});
  };
  const json table = json::parse(evaluate("all").out);
  std::vector<std::string> names;
  for (const auto& entry : table["evaluations"]) names.push_back(entry["protocol"]);
  EXPECT_EQ(names,
            (std::vector<std::string>{"geocage-force", "bodex", "dexgraspnet", "multidex", "geocage-cage"}));
  EXPECT_EQ(table["evaluations"][2]["engine"]["mu"], 3);
  EXPECT_EQ(table["evaluations"][4]["engine"]["mu"], 0);
  EXPECT_EQ(evaluate("bodex,geocage-farce").code, 2);
}

TEST_F(FlowRun, OneAndTwoThreadsGiveTheSameBytes) {
  const auto other = [&](const char* threads, const char* jobs, const std::string& store) {
    const Ended ended =
        geocage(arguments(flow_, {"--jobs", jobs}, store), {std::string("OMP_NUM_THREADS=") + threads});
    return contents_of(json::parse(ended.out));
  };
  const auto expected = contents_of(json::parse(first_.out));
  EXPECT_EQ(other("1", "1", "store_1"), expected);
  EXPECT_EQ(other("2", "2", "store_2"), expected);
}

TEST_F(FlowRun, BrokenItemsAreCountedAndTheOthersGoOn) {
  const auto dataset = *folder_ / "dataset";
  fs::create_directories(dataset);
  fs::copy_file(*folder_ / "bottle.ply", dataset / "bottle.ply", fs::copy_options::overwrite_existing);
  std::ofstream(dataset / "broken.stl") << "solid nothing";
  std::ofstream(dataset / "readme.txt") << "not an object";
  const Ended ended = geocage(arguments(flow_, {"--dataset", dataset.string()}));
  EXPECT_EQ(ended.code, 1) << ended.err;
  const json answer = json::parse(ended.out);
  EXPECT_EQ(answer["counts"]["in"], 2);
  EXPECT_EQ(answer["counts"]["done"], 1);
  EXPECT_EQ(answer["counts"]["failed"], 1);
  for (const auto& slot : answer["slots"])
    if (slot["slot"] == "broken/import") {
      EXPECT_EQ(slot["state"], "failed");
      EXPECT_NE(slot["sentence"].get<std::string>().find("broken.stl"), std::string::npos);
    }
  // A report written later counts alike.
  auto words = arguments(flow_, {"--dataset", dataset.string()});
  words[0] = "report";
  const Ended later = geocage(words);
  EXPECT_EQ(later.code, 1) << later.err;
  EXPECT_EQ(json::parse(later.out)["counts"], answer["counts"]);
}

TEST_F(FlowRun, WhatAMachineCannotGetIsSkippedByName) {
  const fs::path data = *folder_ / "data";
  fs::create_directories(data / "datasets");
  std::ofstream(data / "datasets" / "catalogue.toml")
      << "[unicorn]\nkind = 'mesh'\npackage = 'no-such-package-here'\nversion = '1'\npath = "
         "'unicorn.obj'\nsha256 = '"
      << std::string(64, '0') << "'\nlicence = 'none'\n";
  fs::copy(fs::path(GEOCAGE_HANDS), data / "hands",
           fs::copy_options::recursive | fs::copy_options::overwrite_existing);
  const Ended ended =
      geocage(arguments(flow_, {"--dataset", "unicorn"}),
              {"GEOCAGE_DATA=" + data.string(), "GEOCAGE_DATASETS=" + (*folder_ / "cache").string()});
  EXPECT_EQ(ended.code, 1) << ended.err;
  const json counts = json::parse(ended.out)["counts"];
  EXPECT_EQ(counts["in"], 1);
  EXPECT_EQ(counts["skipped"], 1);
}

TEST_F(FlowRun, SweepMakesAVariantALevel) {
  const auto swept = *folder_ / "sweep.toml";
  quick_flow(*folder_, "[sweep]\n'scan.sigma_m' = [0.0, 0.001]\n'scan.seed' = [1, 2]\n");
  fs::copy_file(flow_, swept, fs::copy_options::overwrite_existing);
  quick_flow(*folder_);
  const json answer = run({"--until", "scan"}, swept);
  const auto states = states_of(answer);
  EXPECT_EQ(answer["counts"]["in"], 4);
  EXPECT_TRUE(states.contains("bottle@scan.seed=2,scan.sigma_m=0.001/scan"));
}

}  // namespace
}  // namespace geocage::tests
