#include "reports/report.h"

#include <cmath>
#include <fstream>
#include <sstream>

#include <gtest/gtest.h>
#include <unistd.h>

#include "datasets/shapes.h"
#include "geometry/cloud.h"
#include "geometry/scene.h"
#include "hands/grasp.h"
#include "pipeline/error.h"
#include "reports/results.h"
#include "tests/reports/html_check.h"
#include "topology/scores.h"

namespace geocage::reports {
namespace {

namespace fs = std::filesystem;

std::string text_of(const fs::path& file) {
  std::ostringstream text;
  text << std::ifstream(file).rdbuf();
  return text.str();
}
bool has(const std::string& text, const std::string& words) {
  return text.find(words) != std::string::npos;
}

/// A torus with analytic scores, a hand beside it, and a test of two grasps, as artefacts of a store.
class Report : public testing::Test {
 protected:
  Report() : folder_(fs::path(testing::TempDir()) / ("report-" + std::to_string(getpid()))) {}
  ~Report() override { fs::remove_all(folder_); }

  fs::path fresh(const std::string& name) const {
    fs::create_directories(folder_ / name);
    return folder_ / name;
  }

  fs::path scores() const {
    topology::Scores scores;
    scores.mesh = datasets::torus(0.05, 0.015, 64, 32);
    for (const auto& p : scores.mesh.vertices) {
      const double cosine = (std::hypot(p.x(), p.y()) - 0.05) / 0.015;
      scores.ball.winding_angle_rad.push_back(cosine > 0.9 ? std::nan("") : 4 + p.x() * 20);
      scores.ball.curvature_sum_rad.push_back(cosine);
    }
    const std::size_t n = scores.mesh.vertices.size();
    for (auto* column : {&scores.ball.ball_vertices, &scores.ball.ball_triangles, &scores.ball.euler})
      column->assign(n, 1);
    scores.ball.ball_area_m2.assign(n, 1e-4);
    scores.ball.accumulated_angle_rad = scores.ball.winding_angle_rad;
    for (auto* column : {&scores.ball.center, &scores.ball.axis}) column->assign(n, geometry::Vec3::Zero());
    scores.ball.radius_m = 0.02;
    topology::Candidate best;
    best.heuristic = "winding";
    best.p_O = {0.065, 0, 0};
    best.n_O = geometry::Vec3::UnitX();
    scores.candidates = {best};
    save_artefact(scores, fresh("scores"));
    return folder_ / "scores";
  }

  fs::path cloud() const {
    geometry::PointCloud cloud;
    cloud.points = datasets::torus(0.05, 0.015, 48, 24).vertices;
    for (const auto& p : cloud.points)
      cloud.normals.push_back((p - 0.05 * geometry::Vec3(p.x(), p.y(), 0).normalized()).normalized());
    for (const auto& p : cloud.points) cloud.view.push_back(p.x() > 0);
    cloud.sensor_origins = {{-0.5, 0, 0.3}, {0.5, 0, 0.3}};
    save_artefact(cloud, fresh("cloud"));
    return folder_ / "cloud";
  }

  fs::path grasps(const hands::Hand& hand) const {
    hands::GraspSet set;
    hands::Grasp grasp;
    grasp.hand = hand.name;
    grasp.object = "ring";
    grasp.X_OH = geometry::Pose(Eigen::AngleAxisd(-std::acos(0.0), geometry::Vec3::UnitY()));
    grasp.X_OH.translation() = geometry::Vec3(0.22, 0, 0);
    grasp.joints_rad = grasp.pregrasp_joints_rad = hands::joint_map(hand.tree, hand.open_rad);
    grasp.scores = {{"winding", 0.75}, {"odd<name>", std::nan("")}};
    set.grasps = {grasp, grasp};
    set.rejected = {{"below the table", 7}, {"palm inside", 2}};
    save_artefact(set, fresh("grasps"));
    return folder_ / "grasps";
  }

  fs::path evaluations(int null_held) const {
    std::ofstream(fresh("evaluations") / "evaluations.json")
        << R"({"schema": "geocage-evaluations 1", "protocol": "geocage-force", "object_geometry": "truth", "seed": 0,
               "counts": {"held": 1, "lost": 1, "rejected": 0, "unsettled": 0, "error": 0}, "valid": true,
               "controls": [{"name": "hand 1 m away", "rule": "no trial may hold", "grasps": 1, "trials": 6, "held": )"
        << null_held << R"(, "passed": 0, "ok": )" << (null_held == 0 ? "true" : "false")
        << R"(}], "evaluations": [)" << evaluation(0, "lost", "-z moved it 61 mm & turned it", false) << ","
        << evaluation(1, "held", "", true) << "]}";
    return folder_ / "evaluations";
  }
  static std::string evaluation(int grasp, const std::string& outcome, const std::string& reason, bool last) {
    return R"({"schema": "geocage-evaluation 1", "grasp": )" + std::to_string(grasp) + R"(, "outcome": ")" +
           outcome + R"(", "reason": ")" + reason +
           R"(", "drift_m": 0.002, "drift_rad": null, "engine": {"name": "Bullet",
           "dt_s": 0.001}, "held_within_2_cm": false, "summary": {"worst": "-z", "fall_s": null}, "directions": [
           {"name": "+x", "held": true, "held_within_2_cm": true, "max_displacement_m": 0.001, "max_rotation_rad": 0.02},
           {"name": "-z", "held": )" +
           (last ? "true" : "false") +
           R"(, "held_within_2_cm": false, "max_displacement_m": 0.061, "max_rotation_rad": 0.3}]})";
  }

  fs::path trajectories() const {
    std::ofstream(fresh("trajectories") / "trajectory_0.json")
        << R"({"schema": "geocage-trajectory 1", "dt_s": 0.02, "joints": ["a"], "q_rad": [[0], [1], [2]], "X_OH": [],
               "min_clearance_m": 0.0031, "certified": false, "outcome": "planned"})";
    return folder_ / "trajectories";
  }

  /// A run of three pairs; without pictures it is quick.
  ReportInput input(int null_held = 0, bool pictures = false) const {
    ReportInput input;
    input.title = "A <test> & more";
    input.flow_text = "objects = [\"<ring>\"]\n";
    input.hands = {hands::load_hand("schunk_sdh")};
    input.counts = {3, 1, 1, 0, 1};
    PairInput pair;
    pair.object = "ring <1> & \"co\"";
    pair.hand = "schunk_sdh";
    pair.outcome = "done";
    pair.source = "package things, MIT";
    pair.truth_known = true;
    if (pictures) pair.cloud = cloud();
    if (pictures) pair.scores = scores();
    pair.grasps = grasps(input.hands[0]);
    pair.trajectories = trajectories();
    pair.evaluations = evaluations(null_held);
    PairInput broken;
    broken.object = "broken";
    broken.hand = "schunk_sdh";
    broken.outcome = "failed";
    broken.sentence = "edge 3-4 has three triangles";
    broken.source = "file";
    PairInput absent = broken;
    absent.object = "absent";
    absent.outcome = "skipped";
    absent.sentence = "no package <here>";
    input.pairs = {pair, broken, absent};
    input.slots = {{"ring/remesh", "remesh", "made", 1.5, 1.5, "", "", {{"edge_cv", 0.125}}},
                   {"ring/score", "score", "hit", 0.001, 0.25, "", "", {}},
                   {"ring/cage", "cage", "hit", 0.001, 2.5, "", "", {{"trials", 30}}},
                   {"broken/remesh", "remesh", "failed", 0.1, 0, "", "edge 3-4 has three triangles", {}}};
    input.parameters = {{"ring/remesh", {{"edge_length_m", "0.004"}}}};
    input.run = {{"on", "a <host>"}};
    return input;
  }

  fs::path folder_;
};

TEST_F(Report, TellsTheWholeStoryOffline) {
  const fs::path index = write_report(input(), folder_ / "out");
  const std::string html = text_of(index);
  EXPECT_EQ(html_flaw(html), "");
  EXPECT_FALSE(has(html, "http:") || has(html, "https:") || has(html, "<script") || has(html, "@import"));
  EXPECT_FALSE(has(html, "<test>") || has(html, "<1>") || has(html, "<host>") || has(html, "<here>") ||
               has(html, "odd<name>"));
  for (const char* words : {"A &lt;test&gt; &amp; more",
                            "ring &lt;1&gt;",
                            "1 + 1 + 0 + 1 = 3",
                            "<b>1 of 2</b>",
                            "9.5 %",
                            "90.5 %",
                            "0 of 6",
                            "as it must be",
                            "edge 3-4 has three",
                            "no package &lt;here&gt;",
                            "below the table",
                            "9 poses",
                            "0.004",
                            "package things, MIT",
                            "the true surface",
                            "3.10 mm free",
                            "moved 61.0 mm",
                            "1.50 s",
                            "Bullet",
                            "trials 30; trials_per_s 12"})
    EXPECT_TRUE(has(html, words)) << words;
}

// A scene of two objects, one of them with a surface: its points and the surface are drawn, and it is
// counted.
TEST_F(Report, ScenesShowTheirObjectsAndSurfaces) {
  geometry::Scene scene;
  const auto ring = datasets::torus(0.05, 0.015, 24, 12);
  for (double at : {-0.1, 0.1}) {
    auto& object = scene.objects.emplace_back();
    object.name = at < 0 ? "left" : "right";
    for (const auto& p : ring.vertices) {
      object.points.push_back(static_cast<int>(scene.cloud.size()));
      scene.cloud.points.push_back(p + geometry::Vec3(at, 0, 0));
    }
  }
  scene.cloud.sensor_origins = {{0, -0.5, 0.5}};
  scene.cloud.support = geometry::Plane{geometry::Vec3::UnitZ(), -0.015};
  save_artefact(scene, fresh("scene"));
  save_artefact(ring, fresh("ring"));
  auto all = input();
  all.scenes = {{"a table", folder_ / "scene", {folder_ / "ring", {}}}};
  const std::string html = text_of(write_report(all, folder_ / "out"));
  EXPECT_EQ(html_flaw(html), "");
  for (const char* words : {"a table.left", "a table.right", "Objects: 2", "1 of 2"})
    EXPECT_TRUE(has(html, words)) << words;
  for (const char* ending : {"-parts.png", "-closed.png"}) {
    int files = 0;
    for (const auto& file : fs::directory_iterator(folder_ / "out" / "pictures"))
      files += file.path().string().ends_with(ending) && fs::file_size(file) > 1000;
    EXPECT_EQ(files, 1) << ending;
  }
}

TEST_F(Report, EveryPictureThatThePageNamesIsThere) {
  const fs::path index = write_report(input(0, true), folder_ / "out");
  const std::string html = text_of(index);
  int pictures = 0;
  for (std::size_t at = 0; (at = html.find("<img src=\"", at)) != std::string::npos; ++pictures) {
    at += 10;
    const fs::path file = index.parent_path() / html.substr(at, html.find('"', at) - at);
    EXPECT_GT(fs::file_size(file), 10000u) << file;
  }
  EXPECT_EQ(pictures, 4) << "scan, two scores, grasp";
}

TEST_F(Report, SaysWhenCountsDoNotAddUp) {
  ReportInput wrong = input();
  EXPECT_FALSE(has(text_of(write_report(wrong, folder_ / "out")), "do not add up"));
  wrong.counts.in = 4;
  EXPECT_TRUE(has(text_of(write_report(wrong, folder_ / "out")), "do not add up"));
}

TEST_F(Report, SaysWhenAControlFailed) {
  const std::string html = text_of(write_report(input(1), folder_ / "out"));
  EXPECT_TRUE(has(html, "This test is not valid"));
  EXPECT_FALSE(has(html, "as it must be"));
}

TEST_F(Report, SameInputGivesTheSameFiles) {
  for (const char* name : {"a", "b"}) write_report(input(0, true), folder_ / name);
  int files = 0;
  for (const auto& entry : fs::recursive_directory_iterator(folder_ / "a")) {
    if (!entry.is_regular_file()) continue;
    EXPECT_EQ(text_of(entry.path()), text_of(folder_ / "b" / fs::relative(entry.path(), folder_ / "a")))
        << entry;
    ++files;
  }
  EXPECT_EQ(files, 5);
}

TEST_F(Report, LivesWithoutAnything) {
  const std::string html = text_of(write_report(ReportInput(), folder_ / "out"));
  EXPECT_EQ(html_flaw(html), "");
  EXPECT_TRUE(has(html, "0 + 0 + 0 + 0 = 0"));
}

TEST_F(Report, ReadsTheLiftWhereItWasAsked) {
  const auto without = read_evaluations(evaluations(0));
  EXPECT_FALSE(without.grasps[0].lift);
  std::string text = text_of(folder_ / "evaluations" / "evaluations.json");
  const std::string before = "\"held_within_2_cm\": false, \"summary\"";
  text.insert(text.find(before), R"("lift": {"outcome": "lost", "phase": "shake x", "released": false}, )");
  std::ofstream(fresh("lifted") / "evaluations.json") << text;
  const auto lifted = read_evaluations(folder_ / "lifted").grasps;
  ASSERT_TRUE(lifted[0].lift);
  EXPECT_EQ(lifted[0].lift->outcome, "lost");
  EXPECT_EQ(lifted[0].lift->phase, "shake x");
  EXPECT_FALSE(lifted[0].lift->released || lifted[1].lift);
}

TEST_F(Report, NamesABrokenArtefact) {
  std::ofstream(fresh("bad") / "evaluations.json") << "{\"schema\": \"geocage-evaluations 7\"}";
  try {
    read_evaluations(folder_ / "bad");
    FAIL() << "another schema was read";
  } catch (const pipeline::UserError& error) {
    EXPECT_EQ(error.fault(), pipeline::Fault::store);
    EXPECT_TRUE(has(error.where(), "evaluations.json"));
  }
}

}  // namespace
}  // namespace geocage::reports
