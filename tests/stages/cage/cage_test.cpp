#include "stages/cage/cage.h"

#include <fstream>
#include <numbers>
#include <sstream>

#include <gtest/gtest.h>
#include <omp.h>

#include "hands/closing.h"
#include "tests/physics/scenes.h"

namespace geocage::stages {
namespace {

using geometry::Pose;
using geometry::Vec3;
using physics::filled;
using physics::Outcome;

constexpr double radius_m = 0.035;

const hands::Hand& sdh() {
  static const hands::Hand hand = hands::load_hand("schunk_sdh");
  return hand;
}
const geometry::SignedDistanceField& ball_field() {
  static const auto field =
      filled(Vec3::Constant(0.08), 0.002, [](const Vec3& p) { return p.norm() - radius_m; });
  return field;
}

/// An octahedron with the ball's centre, even mass and radius: the field is the ball's.
geometry::TriangleMesh ball_mesh() {
  geometry::TriangleMesh mesh;
  for (int axis = 0; axis < 3; ++axis)
    for (const double side : {1.0, -1.0}) mesh.vertices.push_back(side * radius_m * Vec3::Unit(axis));
  for (const int x : {0, 1})
    for (const int y : {2, 3})
      for (const int z : {4, 5})
        mesh.triangles.push_back((x + y + z) % 2 == 0 ? std::array<int, 3>{x, y, z}
                                                      : std::array<int, 3>{x, z, y});
  return mesh;
}

hands::GraspSet grasps(bool closed, double height_m = 0.06) {
  hands::Grasp grasp;
  grasp.hand = sdh().name, grasp.object = "ball";
  grasp.X_OH.translation() = -(sdh().palm_H + height_m * sdh().approach_H);
  Eigen::VectorXd q = sdh().open_rad;
  q[sdh().tree.dof(sdh().spread_dof)] = std::numbers::pi / 3;
  grasp.pregrasp_joints_rad = hands::joint_map(sdh().tree, q);
  if (closed) q = hands::close_hand(sdh(), ball_field(), grasp.X_OH, q, {}).q;
  grasp.joints_rad = hands::joint_map(sdh().tree, q);
  return {{grasp}, {}};
}

CageParams quick() {
  CageParams params;
  params.wrench_amplitudes = {0.5, 5}, params.wrench_seeds = params.search_seeds = 2,
  params.search_samples = 300, params.control_grasps = 1;
  return params;
}

/// Progress grows and ends at its total, whatever there was to do.
class ProgressRun : public pipeline::Run {
 public:
  ~ProgressRun() override { EXPECT_EQ(done_, total_); }
  void progress(std::size_t done, std::size_t total) override {
    EXPECT_GT(done, done_);
    EXPECT_TRUE(total_ == 0 || total_ == total);
    done_ = done, total_ = total;
  }

 private:
  std::size_t done_ = 0, total_ = 0;
};

CageEvaluations caged(const hands::GraspSet& set, double* trials = nullptr) {
  ProgressRun run;
  CageEvaluations all = cage(quick(), run, set, ball_mesh(), ball_field(), sdh());
  if (trials) *trials = run.metrics().at("trials");
  return all;
}

double closed_trials = 0;  ///< of the next one

const CageEvaluations& closed_once() {
  static const CageEvaluations all = caged(grasps(true), &closed_trials);
  return all;
}

std::string saved(const CageEvaluations& all) {
  const auto dir = std::filesystem::path(testing::TempDir()) / "cages";
  std::filesystem::create_directories(dir);
  save_artefact(all, dir);
  std::ostringstream text;
  text << std::ifstream(dir / "cages.json").rdbuf();
  return text.str();
}

// Three fingers spread evenly close over a ball of 70 mm: they meet beyond its equator, which blocks every
// straight way, so that gravity alone never takes it out; open fingers let it go.
TEST(CageStage, three_closed_fingers_keep_a_ball_that_open_ones_lose) {
  const CageEvaluations& closed = closed_once();
  const CageEvaluations open = caged(grasps(false));
  EXPECT_EQ(closed.list[0].retained(), 6) << closed.list[0].reason;
  EXPECT_LT(open.list[0].retained(), 6);
  EXPECT_EQ(open.list[0].outcome, Outcome::lost) << open.list[0].reason;
  EXPECT_EQ(open.list[0].search.result, physics::EscapeSearch::Result::found);
  for (const CageWrench& wrench : open.list[0].wrenches) EXPECT_EQ(wrench.lost, wrench.trials);
  // Motors hold the ball as the locked fingers do.
  ASSERT_EQ(closed.list[0].compliant.size(), 6u);
  EXPECT_EQ(CageEvaluation::held(closed.list[0].compliant), 6);
  EXPECT_EQ(open.list[0].search.found, 2);
  EXPECT_EQ(open.list[0].search.rise_m.size(), 6u);
  ASSERT_EQ(open.list[0].search.unfound_rise_m.size(), 6u);  // bisected
  for (std::size_t i = 0; i < 6; ++i)
    EXPECT_LE(open.list[0].search.unfound_rise_m[i], open.list[0].search.rise_m[i]);
  ASSERT_TRUE(open.list[0].half && closed.list[0].half);
  EXPECT_EQ(open.list[0].half->text(), "below 0.5");
}

TEST(CageStage, controls_are_as_they_must_be) {
  const CageEvaluations& all = closed_once();
  EXPECT_EQ(all.controls.size(), 9u);
  for (const physics::Control& control : all.controls) EXPECT_TRUE(control.ok()) << control.name;
}

// The curve falls from 1 to the share that is told beside it, and all of it is written (the next test reads
// it).
TEST(CageStage, wrenches_have_their_survival_curve) {
  for (const CageEvaluations& all : {closed_once(), caged(grasps(false))})
    for (const CageWrench& wrench : all.list[0].wrenches) {
      ASSERT_FALSE(wrench.curve.empty());
      EXPECT_EQ(wrench.curve.front().share, 1);
      EXPECT_EQ(wrench.curve.back().share, wrench.survival);
      EXPECT_TRUE(
          std::ranges::is_sorted(wrench.curve, std::ranges::greater_equal{}, &physics::SurvivalStep::share));
    }
}

TEST(CageStage, never_calls_a_failed_search_a_cage) {
  const CageEvaluations& all = closed_once();
  EXPECT_EQ(all.list[0].reason.find("caged"), std::string::npos);
  EXPECT_EQ(all.list[0].outcome == Outcome::held, all.list[0].reason.find("no proof") != std::string::npos);
}

TEST(CageStage, same_bytes_for_any_number_of_threads_and_files_read_back) {
  const int threads = omp_get_max_threads();
  omp_set_num_threads(1);
  const std::string one = saved(caged(grasps(true)));
  omp_set_num_threads(2);
  const std::string two = saved(caged(grasps(true)));
  omp_set_num_threads(threads);
  EXPECT_EQ(one, two);
  CageEvaluations read;
  load_artefact(read, std::filesystem::path(testing::TempDir()) / "cages");
  EXPECT_EQ(saved(read), two);
}

TEST(CageStage, records_and_checks_itself) {
  const CageEvaluations& all = closed_once();
  ASSERT_EQ(all.recordings.size(), 6u + 4u + quick().wrench_amplitudes.size());
  for (std::size_t i = 0; i < 6; ++i) EXPECT_EQ(all.recordings[i].outcome, all.list[0].pulls[i].outcome);
  EXPECT_EQ(all.recordings[0].trial, "pull +x");
  EXPECT_EQ(all.recordings[6].trial, "ring 0 deg");
  EXPECT_EQ(all.self_check.trials, quick().self_check_trials);
  EXPECT_EQ(all.self_check.half_step, all.self_check.trials);
  EXPECT_EQ(all.self_check.twice_iterations, all.self_check.trials);
}

// Each finger of the hand opens by some share before the ball gets out; the whole way would let it out.
TEST(CageStage, tells_how_far_each_finger_may_open) {
  const CageEvaluation& closed = closed_once().list[0];
  ASSERT_EQ(closed.loosening.size(), sdh().fingers.size());
  for (const physics::Loosening& one : closed.loosening) {
    ASSERT_TRUE(one.share.level) << one.finger;  // closed it held by the choice of pulls
    EXPECT_LT(*one.share.level, 1) << one.finger;
  }
}

TEST(CageStage, rejects_a_hand_inside_the_object) {
  double trials = 0;
  const CageEvaluations all = caged(grasps(false, -0.02), &trials);
  EXPECT_EQ(all.list[0].outcome, Outcome::rejected);
  EXPECT_NE(all.list[0].reason.find("inside the object"), std::string::npos);
  // No trial but those of the controls. The closed hand has 6 + 4 + 6 pulls, 2 x 2 wrenches, 6 trials twice
  // more, 6 + 4 + 2 for playback, and margins: 10 of the closed hand, and more of each finger.
  int known = 0;
  for (const physics::Control& control : all.controls) known += control.trials;
  EXPECT_EQ(trials, known);
  closed_once();
  EXPECT_GT(closed_trials, known + 16 + 4 + 12 + 12 + 10);
}

}  // namespace
}  // namespace geocage::stages
