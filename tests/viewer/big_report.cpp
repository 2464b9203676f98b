// big_report FOLDER VIEWER [OBJECTS]: a report of 1,000 grasps on 50 objects from made-up artefacts of real
// size and roughness, to measure bytes and opening time (big.mjs). Not a result of anything.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <random>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "datasets/shapes.h"
#include "hands/grasp.h"
#include "motion/trajectory.h"
#include "reports/report.h"
#include "topology/scores.h"

using namespace geocage;
namespace fs = std::filesystem;
using nlohmann::json;

namespace {

constexpr int grasps_each = 20;

/// A torus with 4 to 7 thousand vertices, as rough as a reconstruction: neither positions nor fields are
/// smooth to the last bit.
topology::Scores scores_of(int k, std::mt19937& random) {
  std::normal_distribution<double> noise;
  topology::Scores scores;
  const double R = 0.04 + 0.0004 * k, r = 0.012 + 0.0002 * k;
  scores.mesh = datasets::torus(R, r, 112 + k, 40 + k / 5);
  auto& ball = scores.ball;
  for (auto& p : scores.mesh.vertices) {
    const double side = (std::hypot(p.x(), p.y()) - R) / r;
    ball.winding_angle_rad.push_back(
        side > 0.97 ? std::nan("") : 4.7 + 1.5 * side * std::cos(3 * p.x() / R) + 0.05 * noise(random));
    ball.curvature_sum_rad.push_back(3 * side + 0.1 * noise(random));
    ball.ball_vertices.push_back(600 + static_cast<int>(60 * side + 8 * noise(random)));
    ball.ball_triangles.push_back(1200);
    ball.euler.push_back(side > 0 ? 1 : 0);
    scores.mesh.observed.push_back(std::min(1.0, std::abs(side)));
    p += 2e-4 * geometry::Vec3(noise(random), noise(random), noise(random));
  }
  const std::size_t n = scores.mesh.vertices.size();
  ball.ball_area_m2.assign(n, 1e-3);
  ball.accumulated_angle_rad = ball.winding_angle_rad;
  ball.center.assign(n, geometry::Vec3::Zero());
  ball.axis.assign(n, geometry::Vec3::UnitZ());
  ball.radius_m = 0.06;
  for (int i = 0; i < 24; ++i) {
    topology::Candidate candidate;
    candidate.vertex = static_cast<int>(random() % n);
    candidate.heuristic = i < 12 ? "winding" : "curvature";
    candidate.radius_m = 0.06;
    candidate.winding_angle_rad = 5, candidate.curvature_sum_rad = 2;
    candidate.p_O = scores.mesh.vertices[candidate.vertex];
    scores.candidates.push_back(candidate);
  }
  return scores;
}

hands::GraspSet grasps_of(const hands::Hand& hand, std::mt19937& random) {
  std::uniform_real_distribution<double> unit(0, 1);
  hands::GraspSet set;
  for (int i = 0; i < grasps_each; ++i) {
    hands::Grasp grasp;
    grasp.hand = hand.name;
    grasp.heuristic = i % 2 ? "winding" : "curvature";
    const double turn = 6.28 * unit(random);
    grasp.X_OH = Eigen::AngleAxisd(turn, geometry::Vec3::UnitZ()) *
                 geometry::Pose(Eigen::AngleAxisd(-1.57, geometry::Vec3::UnitY()));
    grasp.X_OH.translation() =
        geometry::Vec3(0.2 * std::cos(turn), 0.2 * std::sin(turn), 0.01 * unit(random));
    grasp.X_OH = hands::file_pose(grasp.X_OH);
    const Eigen::VectorXd q = hand.open_rad + (0.5 * unit(random)) * hand.closing_rad;
    grasp.pregrasp_joints_rad = hands::joint_map(hand.tree, hand.open_rad);
    grasp.joints_rad =
        hands::joint_map(hand.tree, q.cwiseMax(hand.tree.lower_rad).cwiseMin(hand.tree.upper_rad));
    for (const char* name :
         {"rank", "winding_angle_rad", "curvature_sum_rad", "blocked_share", "closure_margin", "contacts",
          "ferrari_canny_low", "ferrari_canny_high", "enclosed_share", "contact_wrap_rad", "com_offset_m",
          "handle_linking", "wrench_volume"})
      grasp.scores[name] = unit(random);
    grasp.force_closure = "force closure";
    set.grasps.push_back(grasp);
  }
  return set;
}

motion::TrajectorySet ways_of(const hands::GraspSet& grasps, const hands::Hand& hand) {
  motion::TrajectorySet ways;
  for (const auto& grasp : grasps.grasps) {
    motion::Trajectory& way = ways.trajectories.emplace_back();
    way.joints = hand.tree.dof_names;
    way.outcome = "planned", way.planner = "aico";
    for (int i = 0; i < 150; ++i) {
      const double t = i / 149.0, s = t * t * (3 - 2 * t);
      std::vector<double> q;
      for (const auto& name : way.joints)
        q.push_back(grasp.pregrasp_joints_rad.at(name) +
                    s * (grasp.joints_rad.at(name) - grasp.pregrasp_joints_rad.at(name)));
      way.q_rad.push_back(q);
      geometry::Pose X = grasp.X_OH;
      X.translation() += (1 - s) * geometry::Vec3(0.1, 0.05, 0.3);
      way.X_OH.push_back(hands::file_pose(X));
    }
  }
  return ways;
}

json evaluations_of(const char* schema, std::mt19937& random) {
  std::uniform_real_distribution<double> unit(0, 1);
  json list = json::array();
  for (int i = 0; i < grasps_each; ++i) {
    json directions = json::array();
    for (const char* name : {"+x", "-x", "+y", "-y", "+z", "-z"})
      directions.push_back({{"name", name},
                            {"held", true},
                            {"outcome", "held"},
                            {"max_displacement_m", 0.01 * unit(random)},
                            {"max_rotation_rad", unit(random)},
                            {"ended_s", 2 * unit(random)}});
    list.push_back({{"schema", "geocage-evaluation 1"},
                    {"grasp", i},
                    {"engine", {{"name", "none"}}},
                    {"outcome", unit(random) < 0.7 ? "held" : "lost"},
                    {"reason", "made up"},
                    {"drift_m", 0.01 * unit(random)},
                    {"drift_rad", unit(random)},
                    {"directions", directions},
                    {"ring", directions},
                    {"wrenches", json::array()},
                    {"escape_search", {{"result", "not found"}}}});
  }
  return {{"schema", schema},         {"protocol", "made up"},     {"object_geometry", "truth"},
          {"counts", json::object()}, {"controls", json::array()}, {"evaluations", list}};
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) return std::fprintf(stderr, "big_report FOLDER VIEWER [OBJECTS]\n"), 2;
  const int objects = argc > 3 ? std::atoi(argv[3]) : 50;
  const fs::path folder = argv[1];
  fs::remove_all(folder);
  std::mt19937 random(1);
  reports::ReportInput input;
  input.title = fmt::format("made up: {} grasps on {} objects", objects * grasps_each, objects);
  input.viewer = argv[2];
  input.hands = {hands::load_hand("schunk_sdh")};
  input.counts = {objects, objects, 0, 0, 0};
  reports::TableInput table{
      "grasps",
      {"object", "hand", "variant", "pair_outcome", "grasp", "heuristic", "score_rank",
       "score_winding_angle_rad", "score_curvature_sum_rad", "force_closure", "outcome", "reason", "held"},
      {}};
  for (int k = 0; k < objects; ++k) {
    const fs::path store = folder / "artefacts" / std::to_string(k);
    const auto dir = [&](const char* name) { return fs::create_directories(store / name), store / name; };
    const auto scores = scores_of(k, random);
    const auto grasps = grasps_of(input.hands[0], random);
    const json tests = evaluations_of("geocage-evaluations 1", random);
    save_artefact(scores, dir("scores"));
    save_artefact(grasps, dir("grasps"));
    save_artefact(ways_of(grasps, input.hands[0]), dir("ways"));
    std::ofstream(dir("evaluations") / "evaluations.json") << tests;
    std::ofstream(dir("cages") / "cages.json") << evaluations_of("geocage-cages 1", random);
    auto& pair = input.pairs.emplace_back();
    pair.object = pair.base = fmt::format("object_{:02}", k);
    pair.hand = "schunk_sdh", pair.outcome = "done", pair.source = "made up";
    pair.scores = store / "scores", pair.grasps = store / "grasps", pair.trajectories = store / "ways";
    pair.evaluations = store / "evaluations", pair.cages = store / "cages";
    for (int i = 0; i < grasps_each; ++i) {
      const auto& grasp = grasps.grasps[i];
      const std::string outcome = tests["evaluations"][i]["outcome"];
      table.rows.push_back({pair.object, pair.hand, "", "done", double(i), grasp.heuristic,
                            grasp.scores.at("rank"), grasp.scores.at("winding_angle_rad"),
                            grasp.scores.at("curvature_sum_rad"), grasp.force_closure, outcome, "made up",
                            outcome == "held" ? 1.0 : 0.0});
    }
  }
  input.tables = {table};
  std::printf("%s\n", reports::write_report(input, folder / "report").c_str());
}
