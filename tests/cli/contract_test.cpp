// Sentences of docs/architecture.md, section 4, that need no flow to run.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <sstream>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "datasets/shapes.h"
#include "geometry/mesh.h"
#include "pipeline/store.h"
#include "tests/cli/program.h"
#include "tests/pipeline/scratch_folder.h"

namespace geocage::tests {
namespace {

using nlohmann::json;

class Contract : public testing::Test {
 protected:
  std::string file(const std::string& name) const { return (folder_ / name).string(); }
  std::string write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name) << text;
    return file(name);
  }
  std::string write(const std::string& name, const geometry::TriangleMesh& mesh) const {
    geometry::write_ply(folder_ / name, mesh);
    return file(name);
  }
  ScratchFolder folder_;
};

TEST_F(Contract, HandsCheckTellsWhatAHandNeeds) {
  const Ended ready = geocage({"hands", "check", "barrett_bh280", "--json"});
  EXPECT_EQ(ready.code, 0) << ready.err;
  EXPECT_TRUE(json::parse(ready.out)["problems"].empty());
  const std::string joint =
      "<joint name='bend' type='revolute'><parent link='a'/><child link='b'/><axis xyz='0 1 0'/>"
      "<limit lower='0' upper='1' velocity='1' effort='1'/></joint>";
  const std::string urdf =
      write("my.urdf", "<robot name='my'><link name='a'/><link name='b'/>" + joint + "</robot>");
  const Ended bare = geocage({"hands", "check", urdf, "--json"});
  EXPECT_EQ(bare.code, 2) << bare.err;
  const json answer = json::parse(bare.out);
  EXPECT_NE(answer["problems"][0].get<std::string>().find("no hand.toml"), std::string::npos);
  const std::string draft = answer["draft"];
  EXPECT_NE(draft.find("joints = [\"bend\"]"), std::string::npos) << draft;
  write("hand.toml", draft);
  EXPECT_EQ(geocage({"hands", "check", urdf}).code, 0) << "the draft loads; its guesses happen to fit";
  EXPECT_EQ(geocage({"hands", "check", "no_such_hand"}).code, 2);
}

TEST_F(Contract, AFolderThatIsNoHandIsSaidToBeNone) {
  std::filesystem::create_directory(file("claw"));
  const Ended folder = geocage({"hands", "check", file("claw")});
  EXPECT_EQ(folder.code, 2);
  EXPECT_NE(folder.err.find("this folder holds no hand.toml"), std::string::npos) << folder.err;
  const Ended nothing = geocage({"hands", "check", file("clwa")});
  EXPECT_EQ(nothing.code, 2);
  EXPECT_EQ(nothing.err.find("did you mean"), std::string::npos) << nothing.err;
}

TEST_F(Contract, HelpNamesEveryCommandAndTheExitCodes) {
  const Ended help = geocage({"--help"});
  EXPECT_EQ(help.code, 0);
  for (const char* word : {"run", "status", "why", "show", "graph", "verify", "gc", "stages", "params",
                           "hands", "datasets", "score", "writhe", "evaluate", "report", "130 interrupted"})
    EXPECT_NE(help.out.find(word), std::string::npos) << word;
}

TEST_F(Contract, EveryCommandHasAnExampleAManualAndACompletion) {
  const Ended completion = geocage({"completion"}), manual = geocage({"man"});
  // the last case of the script holds the commands' names
  const std::string start = "*) words=\"";
  const auto begin = completion.out.rfind(start) + start.size();
  std::istringstream commands(completion.out.substr(begin, completion.out.find('"', begin) - begin));
  int seen = 0;
  for (std::string name; commands >> name;) {
    if (name.starts_with('-')) continue;
    ++seen;
    const Ended help = geocage({name, "--help"});
    EXPECT_NE(help.out.find("Example: "), std::string::npos) << name;
    EXPECT_NE(manual.out.find(".SS " + name + "\n"), std::string::npos) << name;
  }
  EXPECT_GE(seen, 20);
}

TEST_F(Contract, UsageMistakesAreCode2) {
  EXPECT_EQ(geocage({}).code, 2);
  EXPECT_EQ(geocage({"dance"}).code, 2);
  EXPECT_EQ(geocage({"run", "--no-such-flag"}).code, 2);
  EXPECT_EQ(geocage({"score", "x.ply"}).code, 2);  // --radius-m is missing
  for (const char* radius : {"-1", "0", "nan", "inf", "x"}) {
    const Ended ended = geocage({"score", "x.ply", "--radius-m", radius});
    EXPECT_EQ(ended.code, 2);
    EXPECT_NE(ended.err.find("is not a number above 0"), std::string::npos) << ended.err;
  }
  EXPECT_EQ(geocage({"run", "--jobs", "0"}).code, 2);
}

TEST_F(Contract, ParamsPrintsTheTableOfEveryStage) {
  const Ended stages = geocage({"stages", "--json"});
  const json list = json::parse(stages.out)["stages"];
  std::size_t folders = 0;
  for (const auto& entry : std::filesystem::directory_iterator(GEOCAGE_STAGES))
    folders += entry.is_directory();
  EXPECT_EQ(list.size(), folders);
  for (const auto& stage : list) {
    const Ended params = geocage({"params", stage["stage"], "--json"});
    EXPECT_EQ(params.code, 0);
    EXPECT_FALSE(json::parse(params.out)["fields"].empty()) << stage;
  }
  EXPECT_NE(geocage({"params", "remesh"}).out.find("edge_length_m"), std::string::npos);
  const Ended unknown = geocage({"params", "remsh"});
  EXPECT_EQ(unknown.code, 2);
  EXPECT_NE(unknown.err.find("did you mean 'remesh'"), std::string::npos);
}

TEST_F(Contract, AnUnknownCommandOrFlagIsNamedWithTheNearest) {
  const auto told = [](std::initializer_list<std::string> words, const std::string& sentence) {
    const Ended ended = geocage(words);
    EXPECT_EQ(ended.code, 2);
    EXPECT_NE(ended.err.find(sentence), std::string::npos) << ended.err;
  };
  told({"scor", "mug.ply"}, "there is no command 'scor'; did you mean 'score'?");
  told({"datasets", "gett", "mug"}, "there is no command 'gett'; did you mean 'get'?");
  told({"status", "--datset=x"}, "there is no '--datset'; did you mean '--dataset'?");
  told({"run", "--jobs", "0"}, "--jobs");  // a known flag's own mistake
}

TEST_F(Contract, HandsAreListed) {
  const json hands = json::parse(geocage({"hands", "--json"}).out)["hands"];
  const auto sdh =
      std::find_if(hands.begin(), hands.end(), [](const json& hand) { return hand["hand"] == "schunk_sdh"; });
  ASSERT_NE(sdh, hands.end());
  EXPECT_EQ((*sdh)["ball_radius_m"], 0.06);
  EXPECT_EQ((*sdh)["joints"], 8);
  EXPECT_EQ((*sdh)["dofs"], 7);
}

TEST_F(Contract, DatasetsAreListedAndUnknownOnesAreCode2) {
  EXPECT_EQ(geocage({"datasets"}).code, 0);
  const Ended unknown = geocage({"datasets", "get", "mugg"});
  EXPECT_EQ(unknown.code, 2);
  EXPECT_NE(unknown.err.find("did you mean 'mug'"), std::string::npos);
}

TEST_F(Contract, ScoreCsvHasTheContractsColumns) {
  const auto mesh = write("ball.ply", datasets::icosphere(0.05, 3));
  const Ended scored = geocage({"score", mesh, "--radius-m", "0.03", "--out", file("s.csv")});
  EXPECT_EQ(scored.code, 0) << scored.err;
  std::ifstream csv(file("s.csv"));
  std::string line;
  std::getline(csv, line);
  EXPECT_EQ(line,
            "vertex,x_m,y_m,z_m,winding_angle_rad,curvature_sum_rad,ball_vertices,ball_triangles,euler");
  int rows = 0;
  while (std::getline(csv, line)) EXPECT_EQ(std::stoi(line), rows++);
  EXPECT_EQ(rows, 642);
}

// The same answer in both forms; a ball's axis may be undefined, which CSV calls nan and JSON null.
TEST_F(Contract, ScoreJsonHoldsWhatTheCsvHolds) {
  const auto mesh = write("torus.ply", datasets::torus(0.04, 0.015, 24, 12));
  const Ended json_form = geocage({"score", mesh, "--radius-m", "0.02", "--json"});
  std::istringstream csv(geocage({"score", mesh, "--radius-m", "0.02"}).out);
  const json scores = json::parse(json_form.out)["scores"];
  std::string line;
  std::getline(csv, line);
  for (int v = 0; v < 288; ++v) {
    std::getline(csv, line);
    std::istringstream row(line);
    std::vector<std::string> cells;
    for (std::string cell; std::getline(row, cell, ',');) cells.push_back(cell);
    ASSERT_EQ(cells.size(), 9u);
    const json& winding = scores["winding_angle_rad"][v];
    EXPECT_EQ(winding.is_null() ? "nan" : fmt::format("{}", winding.get<double>()), cells[4]);
    EXPECT_EQ(scores["curvature_sum_rad"][v], std::stod(cells[5]));
    EXPECT_EQ(scores["euler"][v], std::stod(cells[8]));
  }
}

TEST_F(Contract, ScorePlyCarriesTheSameNames) {
  const auto mesh = write("ball.ply", datasets::icosphere(0.05, 2));
  ASSERT_EQ(geocage({"score", mesh, "--radius-m", "0.03", "--out", file("s.ply")}).code, 0);
  std::vector<geometry::VertexField> fields;
  geometry::read_own_ply(file("s.ply"), &fields);
  std::vector<std::string> names;
  for (const auto& field : fields) names.push_back(field.name);
  EXPECT_EQ(names, (std::vector<std::string>{"winding_angle_rad", "curvature_sum_rad", "ball_vertices",
                                             "ball_triangles", "euler"}));
}

// Gauss-Bonnet: a ball that is the whole closed surface has the curvature 2 pi chi.
TEST_F(Contract, ScoreOfAWholeSurfaceIsGaussBonnet) {
  const auto mesh = write("torus.ply", datasets::torus(0.04, 0.015, 24, 12));
  const Ended scored = geocage({"score", mesh, "--radius-m", "1", "--metric", "dijkstra"});
  ASSERT_EQ(scored.code, 0) << scored.err;
  std::istringstream csv(scored.out);
  std::string line;
  std::getline(csv, line);
  while (std::getline(csv, line)) {
    std::vector<std::string> cells;
    std::istringstream row(line);
    for (std::string cell; std::getline(row, cell, ',');) cells.push_back(cell);
    ASSERT_EQ(cells.size(), 9u);
    EXPECT_NEAR(std::stod(cells[5]), 0, 1e-9);  // 288 vertices, each good to a few ulp of 2 pi
    EXPECT_EQ(cells[6], "288");
    EXPECT_EQ(cells[8], "0");
  }
}

/// The column ball_vertices of a table of scores.
std::vector<int> ball_sizes(const std::string& table) {
  std::vector<int> sizes;
  std::istringstream csv(table);
  std::string line, cell;
  std::getline(csv, line);
  while (std::getline(csv, line)) {
    std::istringstream row(line);
    for (int i = 0; i < 7; ++i) std::getline(row, cell, ',');
    sizes.push_back(std::stoi(cell));
  }
  return sizes;
}

// Half a step more than one mean edge holds a vertex and its neighbours; 1.5 x the mean edge in metres is
// what any other length of a hop would miss.
TEST_F(Contract, ScoreHopsAreMeanEdgesOfTheMeshAsGiven) {
  auto shape = datasets::icosphere(0.05, 3);
  for (auto& p : shape.vertices) p.z() *= 1.7;  // edges of many lengths
  const auto mesh = write("egg.ply", shape);
  const auto neighbours = geometry::vertex_neighbours(shape);
  const double edge = geometry::mean_edge_m(shape);
  for (const auto& [radius, rings] : {std::pair{0.99 * edge, 0}, std::pair{1.01 * edge, 1}}) {
    const Ended scored = geocage({"score", mesh, "--radius-m", std::to_string(radius)});
    ASSERT_EQ(scored.code, 0) << scored.err;
    const auto sizes = ball_sizes(scored.out);
    ASSERT_EQ(sizes.size(), shape.vertices.size());
    for (int v = 0; v < static_cast<int>(sizes.size()); ++v)
      ASSERT_EQ(sizes[v], 1 + rings * neighbours.size(v)) << v;
  }
}

// Floyd and Warshall's distances, in edges and in metres, tell what each metric has to hold.
TEST_F(Contract, ScoreMetricsAreHopsOrLengthsOfEdges) {
  auto shape = datasets::icosphere(0.05, 2);
  for (auto& p : shape.vertices) p.z() *= 1.7;  // edges of many lengths
  const auto mesh = write("egg.ply", shape);
  const int n = static_cast<int>(shape.vertices.size());
  const double edge = geometry::mean_edge_m(shape), radius = 0.0401;
  const auto neighbours = geometry::vertex_neighbours(shape);
  std::vector<std::vector<int>> balls;
  for (const std::string metric : {"hop", "dijkstra"}) {
    std::vector<double> d(static_cast<std::size_t>(n) * n, 1);  // a metre is far
    for (int v = 0; v < n; ++v) {
      d[v * n + v] = 0;
      for (int i = neighbours.start[v]; i < neighbours.start[v + 1]; ++i) {
        const int w = neighbours.items[i];
        d[v * n + w] = metric == "hop" ? edge : (shape.vertices[v] - shape.vertices[w]).norm();
      }
    }
    for (int via = 0; via < n; ++via)
      for (int v = 0; v < n; ++v)
        for (int w = 0; w < n; ++w) d[v * n + w] = std::min(d[v * n + w], d[v * n + via] + d[via * n + w]);
    const Ended scored = geocage({"score", mesh, "--radius-m", "0.0401", "--metric", metric});
    ASSERT_EQ(scored.code, 0) << scored.err;
    const auto sizes = ball_sizes(scored.out);
    ASSERT_EQ(std::ssize(sizes), n);
    for (int v = 0; v < n; ++v)
      EXPECT_EQ(sizes[v], std::count_if(&d[v * n], &d[v * n] + n, [&](double x) { return x <= radius; }))
          << metric << " " << v;
    balls.push_back(sizes);
  }
  EXPECT_NE(balls[0], balls[1]);
  EXPECT_EQ(ball_sizes(geocage({"score", mesh, "--radius-m", "0.0401"}).out), balls[0]) << "hop by default";
}

TEST_F(Contract, ScoreOfAnOpenMeshIsCode3) {
  const Ended open =
      geocage({"score", write("tube.ply", datasets::open_tube(0.03, 0.1, 24, 8)), "--radius-m", "0.03"});
  EXPECT_EQ(open.code, 3);
  EXPECT_NE(open.err.find("closed manifold"), std::string::npos) << open.err;
  EXPECT_EQ(open.out, "");
}

TEST_F(Contract, UnitsOverrideTheGuard) {
  const auto mesh = write("mm.ply", datasets::icosphere(50, 2));
  const Ended refused = geocage({"score", mesh, "--radius-m", "0.03"});
  EXPECT_EQ(refused.code, 3);
  EXPECT_NE(refused.err.find("0.001"), std::string::npos) << refused.err;
  EXPECT_NE(refused.err.find("mm.ply"), std::string::npos);
  EXPECT_EQ(geocage({"score", mesh, "--radius-m", "0.03", "--units", "mm"}).code, 0);
}

TEST_F(Contract, WritheOfCrossedSegments) {
  const auto a = write("a.csv", "-1,0,0\n1,0,0\n"), b = write("b.csv", "0,-1,1\n0,1,1\n");
  const Ended ended = geocage({"writhe", a, b, "--json"});
  ASSERT_EQ(ended.code, 0) << ended.err;
  const json answer = json::parse(ended.out);
  EXPECT_NEAR(answer["omega_sr"][0][0], -2 * M_PI / 3, 1e-12);  // method: -4 asin(1 / (1 + h^2)), h = 1
  EXPECT_NEAR(answer["gli"], -1.0 / 6, 1e-12);
}

TEST_F(Contract, ClosedPolylinesLink) {
  const auto a = write("a.csv", "-1,-1,0\n1,-1,0\n1,1,0\n-1,1,0\n"),
             b = write("b.csv", "0,0,-1\n2,0,-1\n2,0,1\n0,0,1\n");
  const json answer = json::parse(geocage({"writhe", a, b, "--closed", "--json"}).out);
  EXPECT_NEAR(answer["gli"], -1, 1e-12);  // two linked squares
  EXPECT_EQ(answer["omega_sr"].size(), 4u);
}

TEST_F(Contract, CurvesThatTouchAreTold) {
  const auto a = write("a.csv", "0,0,0\n1,0,0\n"), b = write("b.csv", "3,3,3\n1,1,0\n0.5,0,0\n");
  const Ended ended = geocage({"writhe", a, b});
  EXPECT_EQ(ended.code, 0);
  EXPECT_NE(ended.err.find("segment 0 of the first and 1 of the second"), std::string::npos) << ended.err;
  EXPECT_EQ(geocage({"writhe", a, b, "--quiet"}).err, "");
}

TEST_F(Contract, OutputThatIsLostIsCode5) {
  const Ended full = geocage_in_shell("\"$GEOCAGE\" stages > /dev/full");
  EXPECT_EQ(full.code, 5);
  EXPECT_NE(full.err.find("No space left"), std::string::npos) << full.err;
  EXPECT_EQ(geocage_in_shell("\"$GEOCAGE\" nonsense 2> /dev/full").code, 2);
}

// What is opened after a closed stream would get its number, and what is printed would go into it.
TEST_F(Contract, StreamsMayBeClosed) {
  const std::string store = "--store '" + file("store") + "'";
  { const pipeline::Store made(file("store")); }
  const Ended closed = geocage_in_shell("\"$GEOCAGE\" failures --json " + store + " <&- >&- 2>&-");
  EXPECT_EQ(closed.code, 0);
  EXPECT_EQ(geocage_in_shell("\"$GEOCAGE\" nonsense <&- >&- 2>&-").code, 2);
  EXPECT_EQ(geocage({"verify", "--store", file("store")}).code, 0);
}

TEST_F(Contract, NamesNeedNotBeUtf8) {
  const auto mesh = file("tasse_\xfc.ply");
  geometry::write_ply(mesh, datasets::icosphere(0.04, 2));
  const Ended ended = geocage({"score", mesh, "--radius-m", "0.03", "--json", "--out", file("\xfc.csv")});
  ASSERT_EQ(ended.code, 0) << ended.err;
  EXPECT_TRUE(json::parse(ended.out)["out"].get<std::string>().ends_with("/\xef\xbf\xbd.csv"));
  EXPECT_TRUE(std::filesystem::exists(file("\xfc.csv")));
}

// Whatever a file is called, its object is one of the run, and each format says its name whole.
TEST_F(Contract, ObjectsMayHaveAnyName) {
  std::filesystem::create_directory(file("data"));
  for (const char* name : {"data/t\xfcr.ply", "data/new\nline.ply", "data/quo\"te.ply", "data/quo'te.ply"})
    geometry::write_ply(file(name), datasets::icosphere(0.04, 2));
  std::filesystem::create_directory(file("data/folder.ply"));
  const auto on_data = [&](std::vector<std::string> words) {
    words.insert(words.end(), {"--dataset", file("data"), "--store", file("store"), "--out", file("out")});
    return geocage(words);
  };
  const Ended ended = on_data({"run", "--until", "import", "--json"});
  EXPECT_EQ(ended.code, 1);  // of the folder
  const json answer = json::parse(ended.out);
  EXPECT_EQ(answer["counts"]["in"], 5);
  EXPECT_EQ(answer["counts"]["done"], 4);
  std::vector<std::string> slots;
  for (const auto& slot : answer["slots"]) slots.push_back(slot["slot"]);
  EXPECT_EQ(slots, (std::vector<std::string>{"new%0Aline/import", "quo\"te/import", "quo'te/import",
                                             "t%FCr/import"}));
  EXPECT_NE(on_data({"graph"}).out.find("  \"quo\\\"te/import\";\n"), std::string::npos);
  EXPECT_NE(geocage({"metrics", "*/import", "--store", file("store")}).out.find("\n\"quo\"\"te/import\","),
            std::string::npos);
  on_data({"run", "--until", "cloud", "--set", "scan.range_max_m=0.01"});
  const std::string ledger = geocage({"failures", "--store", file("store")}).out;
  EXPECT_NE(ledger.find("--only 'quo'\\''te/"), std::string::npos) << ledger;
}

// What a terminal would obey is shown in its place; a line of a foreign file is said whole.
TEST_F(Contract, SentencesHoldNoControlCharacters) {
  const Ended ended =
      geocage({"writhe", write("a.csv", std::string("x\0\x1b[2Jy\n", 7)), write("b.csv", "0,0,0\n")});
  EXPECT_EQ(ended.code, 3);
  EXPECT_NE(ended.err.find("'x\\x00\\x1b[2Jy'"), std::string::npos) << ended.err;
}

// As an unset variable of a shell is. A store at "" was made in the current folder.
TEST_F(Contract, AnEmptyValueIsAMistake) {
  for (const std::vector<std::string>& words : {std::vector<std::string>{"verify", "--store", ""},
                                                {"run", "--object", ""},
                                                {"run", "--out", ""},
                                                {"run", ""},
                                                {"show", ""},
                                                {"datasets", "get", ""},
                                                {"hands", "check", ""}}) {
    const Ended ended = geocage(words);
    EXPECT_EQ(ended.code, 2) << words[0];
    EXPECT_NE(ended.err.find(": error: the value is empty"), std::string::npos) << ended.err;
  }
  EXPECT_EQ(geocage({"run", "--stage-seconds", "1e300"}).code, 2);  // no number of an int
  EXPECT_NE(geocage({"run", "--retry", "x"}).err.find("failed"), std::string::npos);
  EXPECT_EQ(geocage({"hands", "check", std::string(100'000, 'a')}).code, 2);
  const Ended lost = geocage({"view", file("nothing.ply"), "--out", file("page")});
  EXPECT_EQ(lost.code, 3);
  EXPECT_FALSE(std::filesystem::exists(file("page")));
}

TEST_F(Contract, StoreOfAnotherKindIsCode5) {
  write("song", "la");
  EXPECT_EQ(geocage({"verify", "--store", folder_.path().string()}).code, 5);
}

// A mistyped --store is said, and not made. A flow may be looked at before there is a store.
TEST_F(Contract, CommandsThatLookMakeNoStore) {
  const std::string store = file("strore");
  for (const std::vector<std::string>& words : {std::vector<std::string>{"verify"},
                                                {"gc"},
                                                {"gc", "--dry-run"},
                                                {"failures"},
                                                {"metrics", "*"},
                                                {"show", "mug/remesh"},
                                                {"report", "--out", file("out")}}) {
    auto all = words;
    all.insert(all.end(), {"--store", store});
    const Ended ended = geocage(all);
    EXPECT_EQ(ended.code, 5) << words[0];
    EXPECT_EQ(ended.out, "") << words[0];
    EXPECT_TRUE(ended.err.starts_with(store + ": error: there is no store here (")) << ended.err;
    EXPECT_EQ(std::ranges::count(ended.err, '\n'), 1) << ended.err;
  }
  const std::string flow = write("flow.toml", "objects = ['torus']\n");
  for (const std::vector<std::string>& words :
       {std::vector<std::string>{"status"}, {"why", "torus/import"}, {"graph"}, {"run", "--dry-run"}}) {
    auto all = words;
    all.insert(all.end(), {flow, "--store", store, "--out", file("out")});
    const Ended ended = geocage(all);
    EXPECT_EQ(ended.code, 0) << words[0] << ended.err;
    EXPECT_NE(ended.out.find("torus/import"), std::string::npos) << ended.out;
    EXPECT_NE(ended.err.find(store + ": there is no store here yet"), std::string::npos) << ended.err;
  }
  EXPECT_FALSE(std::filesystem::exists(store));
  EXPECT_FALSE(std::filesystem::exists(file("out")));
}

// What brings files clears away what it began, its programs too.
TEST_F(Contract, AnInterruptedDownloadLeavesNothing) {
  write("catalogue.toml",
        "[thing]\nkind = 'mesh'\nurl = 'https://localhost/thing.obj'\nlicence = 'MIT'\n"
        "sha256 = '" +
            std::string(64, '0') + "'\n");
  std::filesystem::create_directory(file("bin"));
  write("bin/curl", "#!/bin/sh\nsleep 60 &\necho $! > '" + file("sleeper.new") + "'\nmv '" +
                        file("sleeper.new") + "' '" + file("sleeper") + "'\nwait\n");
  std::filesystem::permissions(file("bin/curl"), std::filesystem::perms::owner_all);
  for (const char* signal : {"INT", "TERM", "HUP"}) {
    const Ended ended = geocage_in_shell(
        "cd '" + folder_.path().string() +
        "' && rm -f sleeper && export PATH=\"$PWD/bin:$PATH\"\n"
        "GEOCAGE_CATALOGUE=catalogue.toml GEOCAGE_DATASETS=data \"$GEOCAGE\" datasets get thing & pid=$!\n"
        "while [ ! -e sleeper ]; do sleep 0.02; done\n"
        "kill -" +
        std::string(signal) +
        " $pid; wait $pid; code=$?\n"
        "for i in $(seq 100); do kill -0 $(cat sleeper) 2>/dev/null || exit $code; sleep 0.02; done\n"
        "kill $(cat sleeper); exit 99");
    EXPECT_EQ(ended.code, 130) << signal << ended.err;
    EXPECT_NE(ended.err.find("goes on from here"), std::string::npos) << ended.err;
    int left = 0;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(file("data")))
      left += entry.is_regular_file() || entry.path().filename().string().starts_with("geocage");
    EXPECT_EQ(left, 0) << signal;
  }
}

TEST_F(Contract, EmptyStoreVerifiesAndCollects) {
  { const pipeline::Store made(file("store")); }
  EXPECT_EQ(geocage({"verify", "--store", file("store")}).code, 0);
  EXPECT_EQ(json::parse(geocage({"gc", "--dry-run", "--json", "--store", file("store")}).out)["entries"], 0);
  EXPECT_EQ(geocage({"gc", "--store", file("store")}).code, 0);
}

TEST_F(Contract, GarbageOfAStoreInUseIsCode5) {
  const pipeline::Store store(file("store"));
  const Ended refused = geocage({"gc", "--json", "--store", file("store")});
  EXPECT_EQ(refused.code, 5);
  EXPECT_TRUE(refused.out.empty());
  EXPECT_EQ(geocage({"gc", "--dry-run", "--store", file("store")}).code, 0);
}

}  // namespace
}  // namespace geocage::tests
