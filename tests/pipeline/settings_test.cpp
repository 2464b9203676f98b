#include "pipeline/settings.h"

#include <fstream>

#include <gtest/gtest.h>

#include "tests/pipeline/scratch_folder.h"

namespace geocage::pipeline {
namespace {

struct Params {
  int sweeps = 10;
  double edge_length_m = 0.004;
  std::string metric = "hop";
  std::vector<double> radii_m;
  std::vector<std::string> heuristics = {"winding"};
  std::uint64_t seed = 1;
  void visit(Fields& f) {
    f("sweeps", sweeps, {1, 100}, "");
    f("edge_length_m", edge_length_m, {1e-4, 1}, "");
    f("metric", metric, {"hop", "dijkstra"}, "");
    f("radii_m", radii_m, {0}, "");
    f("heuristics", heuristics, {"winding", "curvature"}, "");
    f("seed", seed, "");
  }
};

/// Settings of a file's text, put into params; the mistakes.
std::vector<std::string> read(const std::string& toml, Params& params) {
  const tests::ScratchFolder folder;
  std::ofstream(folder / "flow.toml") << toml;
  std::vector<std::string> mistakes;
  for (const auto& setting : read_settings(folder / "flow.toml")) apply(setting, fields_of(params), mistakes);
  for (auto& line : mistakes) line = line.substr(line.find("flow.toml"));
  return mistakes;
}

TEST(Settings, EveryTypeArrives) {
  Params p;
  EXPECT_TRUE(read("[remesh]\nsweeps = 3\nedge_length_m = 1\nmetric = 'dijkstra'\nradii_m = [0.1, 2]\n"
                   "heuristics = ['curvature']\nseed = 7\n",
                   p)
                  .empty());
  EXPECT_EQ(p.sweeps, 3);
  EXPECT_EQ(p.edge_length_m, 1.0);
  EXPECT_EQ(p.metric, "dijkstra");
  EXPECT_EQ(p.radii_m, (std::vector<double>{0.1, 2}));
  EXPECT_EQ(p.heuristics, std::vector<std::string>{"curvature"});
  EXPECT_EQ(p.seed, 7u);
}

TEST(Settings, AllMistakesAtOnceWithPlaceAndNearestName) {
  Params p;
  const auto mistakes =
      read("[remesh]\nsweeps = 0\nedge_lenght_m = 0.1\nmetric = 'hops'\nradii_m = 'x'\n", p);
  ASSERT_EQ(mistakes.size(), 4u);
  EXPECT_EQ(mistakes[1],
            "flow.toml:4:1: error: [remesh] metric: 'hops' is not a choice; did you mean 'hop'?");
  EXPECT_NE(std::find(mistakes.begin(), mistakes.end(),
                      "flow.toml:2:1: error: [remesh] sweeps: 0 is outside [1, 100]"),
            mistakes.end());
  EXPECT_NE(
      std::find(mistakes.begin(), mistakes.end(),
                "flow.toml:3:1: error: [remesh] unknown key 'edge_lenght_m'; did you mean 'edge_length_m'?"),
      mistakes.end());
}

TEST(Settings, NoNameIsGuessedWhereNoneIsNear) {
  const std::vector<std::string> known{"mug", "schunk_sdh", "remesh"};
  EXPECT_EQ(did_you_mean("xylophone", known), "");
  EXPECT_EQ(did_you_mean("", known), "");
  EXPECT_EQ(did_you_mean("cat", {}), "");
  EXPECT_EQ(did_you_mean("mugg", known), "; did you mean 'mug'?");
  EXPECT_EQ(did_you_mean("schu", known), "; did you mean 'schunk_sdh'?") << "the beginning of a name";
  EXPECT_EQ(did_you_mean("remehs", known), "; did you mean 'remesh'?");
  Params p;
  const auto mistakes = read("[remesh]\nmetric = 'xylophone'\n", p);
  ASSERT_EQ(mistakes.size(), 1u);
  EXPECT_EQ(mistakes[0],
            "flow.toml:2:1: error: [remesh] metric: 'xylophone' is not a choice; there are hop, dijkstra");
}

TEST(Settings, FloatForWholeNumberIsRefused) {
  Params p;
  EXPECT_EQ(read("[remesh]\nsweeps = 2.5\n", p).size(), 1u);
  EXPECT_EQ(read("[remesh]\nedge_length_m = nan\n", p).size(), 1u);
  EXPECT_EQ(read("[remesh]\nseed = -1\n", p).size(), 1u);
}

TEST(Settings, SyntaxNamesLineAndColumn) {
  Params p;
  try {
    read("[remesh]\nsweeps = = 3\n", p);
    FAIL();
  } catch (const ConfigurationError& error) {
    EXPECT_NE(std::string(error.what()).find("flow.toml:2:"), std::string::npos);
    EXPECT_EQ(error.fault(), Fault::configuration);
  }
}

TEST(Settings, MissingFileIsTheUsersMistake) {
  EXPECT_THROW(read_settings("no/such.toml"), UserError);
  EXPECT_THROW(read_settings("."), UserError);
}

TEST(Settings, CommandLine) {
  const Setting number = parse_setting("scan.sigma_m=0.001");
  EXPECT_EQ(number.stage, "scan");
  EXPECT_EQ(number.field, "sigma_m");
  EXPECT_EQ(std::get<double>(number.value), 0.001);
  EXPECT_EQ(std::get<std::string>(parse_setting("balls.metric=dijkstra").value), "dijkstra");
  EXPECT_EQ(std::get<std::vector<double>>(parse_setting("balls.radii_m=[0.1, 0.2]").value).size(), 2u);
  EXPECT_THROW(parse_setting("nonsense"), ConfigurationError);
  EXPECT_THROW(parse_setting("a=b.c"), ConfigurationError);
}

}  // namespace
}  // namespace geocage::pipeline
