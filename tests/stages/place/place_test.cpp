#include "stages/place/place.h"

#include <fstream>
#include <set>

#include <gtest/gtest.h>
#include <omp.h>

#include "datasets/shapes.h"
#include "geometry/clearance.h"
#include "geometry/mesh_files.h"
#include "tests/pipeline/scratch_folder.h"

namespace geocage::stages {
namespace {

using geometry::Pose;
using geometry::Vec3;

constexpr double radius_m = 0.035, half_height_m = 0.06;

/// A cylinder about z, and one candidate on its side at `height_m`.
struct Scene {
  topology::Scores scores;
  geometry::SignedDistanceField field;
  geometry::PointCloud cloud;
  geometry::SignedDistanceField others;
  hands::Hand hand = hands::load_hand("schunk_sdh");
  pipeline::Run run;

  explicit Scene(double height_m = 0, const std::string& heuristic = "winding") {
    scores.mesh = datasets::capped_cylinder(radius_m, 2 * half_height_m, 64);
    scores.ball.radius_m = 0.06;
    scores.candidates = {candidate(height_m, heuristic)};
    field = geometry::build_distance_field(scores.mesh, {.cells = 40, .pad_m = 0.03, .refine = 2});
  }

  static topology::Candidate candidate(double height_m, const std::string& heuristic) {
    topology::Candidate c;
    c.heuristic = heuristic;
    c.p_O = Vec3(radius_m, 0, height_m);
    c.n_O = Vec3::UnitX();
    c.center_O = Vec3(0, 0, height_m);
    c.axis_O = Vec3::UnitZ();
    return c;
  }

  hands::GraspSet place(const PlaceParams& params = {}) {
    return stages::place(params, run, scores, field, cloud, others, hand);
  }

  std::vector<hands::PlacedCapsule> capsules(const hands::Grasp& grasp,
                                             const std::map<std::string, double>& joints) {
    return hands::placed_capsules(hand, grasp.X_OH, hands::joint_vector(hand.tree, joints, "test"));
  }
};

/// Distance of a capsule's surface to the exact cylinder, from 200 points of its axis (0.25 mm apart or
/// less).
double distance_to_cylinder_m(const hands::PlacedCapsule& capsule) {
  double nearest = 1;
  for (int i = 0; i <= 200; ++i) {
    const Vec3 p = capsule.a + i / 200.0 * (capsule.b - capsule.a);
    const double side = std::hypot(p.x(), p.y()) - radius_m, cap = std::abs(p.z()) - half_height_m;
    nearest = std::min(
        nearest, std::hypot(std::max(side, 0.0), std::max(cap, 0.0)) + std::min(std::max(side, cap), 0.0));
  }
  return nearest - capsule.radius_m;
}

int sum(const std::map<std::string, int>& counts) {
  int total = 0;
  for (const auto& [rule, count] : counts) total += count;
  return total;
}

TEST(Place, WrapsACylinderInThePlaneAcrossItsAxis) {
  Scene scene;
  const auto set = scene.place({.max_per_candidate = 100, .max_grasps = 100});
  ASSERT_FALSE(set.grasps.empty());
  for (const auto& grasp : set.grasps) {
    EXPECT_EQ(grasp.hand, "schunk_sdh");
    EXPECT_EQ(grasp.heuristic, "winding");
    EXPECT_LT((grasp.X_OH.linear() * Vec3::UnitZ() + Vec3::UnitX()).norm(), 1e-9)
        << "the palm faces the surface";
    EXPECT_NEAR(std::abs((grasp.X_OH.linear() * Vec3::UnitY()).z()), 1, 1e-9) << "it closes across the axis";
    EXPECT_EQ(grasp.scores.at("fingers"), 3);
    EXPECT_NEAR(grasp.scores.at("blocked_share"), 40 / 42.0, 1e-9)
        << "all ways out but the two along the axis";
    double base = 1, fingers = 1;
    const auto placed = scene.capsules(grasp, grasp.joints_rad);
    for (std::size_t i = 0; i < placed.size(); ++i) {
      const std::string& link = scene.hand.tree.links[scene.hand.capsules[i].link];
      double& nearest = link == "palm" || link.ends_with("1") ? base : fingers;
      nearest = std::min(nearest, distance_to_cylinder_m(placed[i]));
    }
    EXPECT_GT(fingers, -0.001) << "no finger is inside";
    EXPECT_LT(fingers, 0.001) << "some finger touches";
    // First contact is found to 1 mm and 0.5 mm deep; the spread turns the knuckles by 3 mm at most.
    EXPECT_NEAR(base, grasp.scores.at("gap_m"), 0.0045);
    for (const auto& capsule : scene.capsules(grasp, grasp.pregrasp_joints_rad))
      EXPECT_GT(distance_to_cylinder_m(capsule), 0.0015)
          << "the open hand is free (2 mm, field error 0.1 mm)";
  }
}

TEST(Place, AccountsForEveryPose) {
  Scene scene;
  scene.scores.candidates.push_back(Scene::candidate(0.01, "curvature"));
  const auto set = scene.place({.max_grasps = 1});
  EXPECT_EQ(set.grasps.size(), 1u);
  // approaches x gaps x spreads x (2 rolls for winding + 4 for curvature)
  EXPECT_EQ(scene.run.metrics().at("poses"), 2 * 2 * 2 * (2 + 4));
  EXPECT_EQ(scene.run.metrics().at("poses"), sum(set.rejected) + 1);
  EXPECT_GT(set.rejected.at("outranked"), 0);
  for (const auto& [rule, count] : set.rejected)
    EXPECT_EQ(scene.run.metrics().at("rejected: " + rule), count);
}

TEST(Place, RanksByWhatTheClosedHandBlocks) {
  Scene scene;
  const auto all = scene.place({.max_per_candidate = 100, .max_grasps = 100}).grasps;
  ASSERT_GT(all.size(), 1u);
  for (std::size_t i = 1; i < all.size(); ++i)
    EXPECT_GE(all[i - 1].scores.at("rank"), all[i].scores.at("rank"));
  for (const auto& grasp : all)
    EXPECT_DOUBLE_EQ(grasp.scores.at("rank"),
                     grasp.scores.at("blocked_share") + 0.3 * grasp.scores.at("closure_margin"));
  const auto best = scene.place().grasps;
  ASSERT_EQ(best.size(), 1u) << "one grasp a candidate";
  EXPECT_EQ(best[0].X_OH.matrix(), all[0].X_OH.matrix());
}

TEST(Place, KeepsOffTheSupportAndLiftsTheHandForIt) {
  Scene scene(-0.03);
  const PlaceParams params{.max_com_offset_m = 0.05, .max_per_candidate = 100, .max_grasps = 100};
  const auto floating = scene.place(params);
  scene.cloud.support = geometry::Plane{Vec3::UnitZ(), -half_height_m};
  const auto lowest = [&](const hands::Grasp& grasp) {
    double low = 1;
    for (const auto* joints : {&grasp.joints_rad, &grasp.pregrasp_joints_rad})
      for (const auto& capsule : scene.capsules(grasp, *joints))
        low = std::min({low, capsule.a.z() - capsule.radius_m, capsule.b.z() - capsule.radius_m});
    return low + half_height_m;
  };
  double below = 1;
  for (const auto& grasp : floating.grasps) below = std::min(below, lowest(grasp));
  EXPECT_LT(below, 0)
      << "without the rule a hand would reach into the table: the palm is 61 mm wide to each side";
  const auto standing = scene.place(params);
  ASSERT_FALSE(standing.grasps.empty());
  for (const auto& grasp : standing.grasps) {
    EXPECT_GE(lowest(grasp), params.support_clearance_m - 1e-6);
    EXPECT_GT(grasp.scores.at("lift_m"), 0.03) << "61 mm of palm, 30 mm of room";
  }
  auto unliftable = params;
  unliftable.max_lift_m = 0;
  const auto none = scene.place(unliftable);
  EXPECT_TRUE(none.grasps.empty());
  EXPECT_GT(none.rejected.at("too near the support"), 0);
}

TEST(Place, NoGraspIsAResultWithItsReasons) {
  Scene scene(0.05);
  const auto set = scene.place();
  EXPECT_TRUE(set.grasps.empty());
  EXPECT_EQ(set.rejected, (std::map<std::string, int>{{"far from the centre of mass", 16}}))
      << "50 mm from the line";
  scene.scores.candidates.clear();
  EXPECT_TRUE(scene.place().grasps.empty());
}

/// No limit on the number of grasps, and nothing measured: hulls take their time.
PlaceParams everything() {
  PlaceParams params;
  params.max_per_candidate = params.max_grasps = 1000;
  params.measures = false;
  return params;
}

TEST(Place, MeasuresWhatItKeeps) {
  Scene scene;
  const auto set = scene.place();
  ASSERT_FALSE(set.grasps.empty());
  for (const auto& grasp : set.grasps) {
    const auto& scores = grasp.scores;
    EXPECT_GT(scores.at("axis_linking"), 0.5) << "the fingers go round the cylinder";
    EXPECT_GT(scores.at("contact_wrap_rad"), 3) << "more than half a turn";
    EXPECT_GT(scores.at("wrap_rad.thumb"), 0.5);
    EXPECT_GT(scores.at("enclosed_share"), 0.2);
    EXPECT_GT(scores.at("flux_share"), 0.1);
    EXPECT_LE(scores.at("ferrari_canny_low"), scores.at("ferrari_canny_high"));
    // The farthest surface point from the centre: the rim of a cap.
    EXPECT_NEAR(scores.at("torque_length_m"), std::hypot(radius_m, half_height_m), 1e-9);
    EXPECT_EQ(grasp.force_closure, "force closure") << "friction 0.6 and contacts all round";
    EXPECT_GT(scores.at("ferrari_canny_low"), 0);
    EXPECT_GT(scores.at("wrench_volume"), 0);
  }
  PlaceParams slippery;
  slippery.friction_mu = 0;
  for (const auto& grasp : scene.place(slippery).grasps) {
    EXPECT_NE(grasp.force_closure, "force closure")
        << "nothing keeps it from sliding along its axis or turning";
    EXPECT_EQ(grasp.scores.at("ferrari_canny_low"), 0);
  }
}

TEST(Place, LocalSearchAddsItsPosesAndIsTheSameAgain) {
  Scene scene;
  PlaceParams params = everything();
  const auto listed = scene.place(params);
  params.local_samples = 60;
  const auto searched = scene.place(params);
  EXPECT_EQ(scene.run.metrics().at("poses"), 2 * 2 * 2 * 2 + 60);
  EXPECT_GT(searched.grasps.size(), listed.grasps.size());
  EXPECT_GE(searched.grasps[0].scores.at("rank"), listed.grasps[0].scores.at("rank"));
  bool tilted = false;
  for (const auto& grasp : searched.grasps)
    tilted |= std::abs((grasp.X_OH.linear() * Vec3::UnitZ()).dot(Vec3::UnitX()) + 1) > 0.01;
  EXPECT_TRUE(tilted);
  const auto again = scene.place(params);
  ASSERT_EQ(again.grasps.size(), searched.grasps.size());
  for (std::size_t i = 0; i < again.grasps.size(); ++i)
    EXPECT_EQ(again.grasps[i].X_OH.matrix(), searched.grasps[i].X_OH.matrix());
  params.seed = 2;
  const auto other = scene.place(params);
  EXPECT_TRUE(other.grasps.size() != searched.grasps.size() ||
              other.grasps.back().X_OH.matrix() != searched.grasps.back().X_OH.matrix());
}

TEST(Place, RefusesOccupiedSpaceUnseenSurfaceAndWhatIsOutOfReach) {
  Scene scene;
  const auto free = scene.place(everything());
  ASSERT_FALSE(free.grasps.empty());
  geometry::PointCloud post;  // a rod along the approach, where the palm would be
  for (int i = 0; i < 40; ++i) post.points.emplace_back(radius_m + 0.03 + 0.0025 * i, 0, 0);
  scene.others = geometry::clearance_field(geometry::map_of_rays(post, 0.005), {});
  auto refused = scene.place(everything());
  EXPECT_TRUE(refused.grasps.empty());
  EXPECT_EQ(refused.rejected.at("meets known occupied space"), static_cast<int>(free.grasps.size()));
  for (Vec3& p : post.points) p.x() = -0.5;  // and far away
  scene.others = geometry::clearance_field(geometry::map_of_rays(post, 0.005), {});
  EXPECT_EQ(scene.place(everything()).grasps.size(), free.grasps.size());

  scene.scores.mesh.observed.assign(scene.scores.mesh.vertices.size(), 0.05);
  refused = scene.place(everything());
  EXPECT_TRUE(refused.grasps.empty());
  EXPECT_EQ(refused.rejected.at("never observed"), 16);
  scene.scores.mesh.observed.clear();

  PlaceParams near = everything();
  near.reach_from_m = {-1, 0, 0};
  near.max_reach_m = 1;
  EXPECT_TRUE(scene.place(near).grasps.empty()) << "the hand stands at x > 35 mm";
  EXPECT_GT(scene.place(near).rejected.at("out of reach"), 0);
  near.max_reach_m = 1.5;
  EXPECT_EQ(scene.place(near).grasps.size(), free.grasps.size());
}

TEST(Place, RefusesLinesThatMissAndHandsThatDontFit) {
  Scene scene;
  PlaceParams params = everything();
  params.max_com_offset_m = 10;
  topology::Candidate& candidate = scene.scores.candidates[0];
  candidate.n_O = Vec3::UnitY();  // past the cylinder, 1 m off: the palm is 66 mm wide at most
  candidate.p_O = candidate.center_O = Vec3(1, 0, 0);
  auto refused = scene.place(params).rejected;
  EXPECT_EQ(refused, (std::map<std::string, int>{{"no direction to the ball's centre", 8},
                                                 {"palm meets nothing", 8}}));
  candidate = Scene::candidate(0, "winding");
  params.open_clearance_m = 0.1;  // more than a hand around the cylinder can leave
  refused = scene.place(params).rejected;
  EXPECT_EQ(refused, (std::map<std::string, int>{{"open hand collides", 16}}));
}

TEST(Place, OpensTheHandUntilItIsFreeUnlessToldNotTo) {
  // Open fingers begin 38 mm from the palm's middle and lean out by 0.8 rad, so that 60 mm up their inner
  // side is 38 + 60 tan 0.8 - 14 / cos 0.8 = 80 mm out: a ball of 100 mm, 5 mm off the palm, reaches 89 mm
  // there.
  constexpr double ball_m = 0.1;
  Scene scene;
  scene.scores.mesh = datasets::icosphere(ball_m, 3);
  scene.field = geometry::build_distance_field(scene.scores.mesh, {.cells = 32, .pad_m = 0.03, .refine = 2});
  scene.scores.candidates[0].p_O = Vec3(ball_m, 0, 0);
  PlaceParams params = everything();
  params.approaches = {"normal"};
  params.gaps_m = {0.005};
  params.min_blocked_share = 0;
  const auto opened = scene.place(params);
  ASSERT_FALSE(opened.grasps.empty());
  for (const auto& grasp : opened.grasps)
    EXPECT_LT(grasp.pregrasp_joints_rad.at("finger_12"), -0.8 - params.opening_step_rad / 2);
  params.max_opening_rad = 0;
  const auto stiff = scene.place(params);
  EXPECT_TRUE(stiff.grasps.empty());
  EXPECT_EQ(stiff.rejected, (std::map<std::string, int>{{"open hand collides", 4}}));
}

TEST(Place, TakesTheBaselinesItIsAskedFor) {
  Scene scene;
  for (const char* name : {"curvature", "combined", "random"})
    scene.scores.candidates.push_back(Scene::candidate(0.005, name));
  PlaceParams params = everything();
  for (const std::string name : {"winding", "curvature", "combined", "random"}) {
    params.heuristics = {name};
    const auto set = scene.place(params);
    ASSERT_FALSE(set.grasps.empty()) << name;
    for (const auto& grasp : set.grasps) EXPECT_EQ(grasp.heuristic, name);
  }
  params.heuristics.clear();
  std::set<std::string> all;
  for (const auto& grasp : scene.place(params).grasps) all.insert(grasp.heuristic);
  EXPECT_EQ(all.size(), 4u) << "none named: all that were scored";
}

TEST(Place, TurnsWithTheObject) {
  const auto grasps_of = [](const Pose& X_AO) {
    Scene scene;
    for (Vec3& p : scene.scores.mesh.vertices) p = X_AO * p;
    topology::Candidate& candidate = scene.scores.candidates[0];
    for (Vec3* p : {&candidate.p_O, &candidate.center_O}) *p = X_AO * *p;
    for (Vec3* d : {&candidate.n_O, &candidate.axis_O}) *d = X_AO.linear() * *d;
    scene.field =
        geometry::build_distance_field(scene.scores.mesh, {.cells = 64, .pad_m = 0.03, .refine = 3});
    PlaceParams params = everything();
    params.spreads_rad = {0};
    return scene.place(params).grasps;
  };
  const Pose X_AO =
      Eigen::Translation3d(0.2, -0.1, 0.3) * Eigen::AngleAxisd(0.9, Vec3(1, 2, -1).normalized());
  const auto still = grasps_of(Pose::Identity()), turned = grasps_of(X_AO);
  ASSERT_EQ(still.size(), turned.size());
  for (const auto& grasp : still) {
    // The same grasp in the other list: ranks are equal up to the field's error, so the order may differ.
    double best_m = 1, best_rad = 1;
    for (const auto& other : turned) {
      const Pose error = grasp.X_OH.inverse() * X_AO.inverse() * other.X_OH;
      if (error.translation().norm() >= best_m || !error.linear().isIdentity(1e-6)) continue;
      best_m = error.translation().norm();
      best_rad = 0;
      for (const auto& [joint, value] : grasp.joints_rad)
        best_rad = std::max(best_rad, std::abs(value - other.joints_rad.at(joint)));
    }
    EXPECT_LT(best_m, 0.0015) << "first contact is found in steps of 1 mm, the field is right to 0.1 mm";
    EXPECT_LT(best_rad, 0.04) << "1.5 mm at the 0.05 m where a finger touches";
  }
}

TEST(Place, AntipodalPairsOfABoxAreItsOppositeFaces) {
  Scene scene;
  scene.scores.mesh = datasets::box(Vec3(0.05, 0.08, 0.06), 8);
  scene.scores.candidates.clear();
  scene.field = geometry::build_distance_field(scene.scores.mesh, {.cells = 48, .pad_m = 0.03, .refine = 2});
  PlaceParams params = everything();
  params.heuristics = {"antipodal"};
  const auto set = scene.place(params);
  ASSERT_FALSE(set.grasps.empty());
  for (const auto& grasp : set.grasps) {
    EXPECT_EQ(grasp.heuristic, "antipodal");
    // Fingers close along x of the hand: across a pair of faces, up to the friction cone of the pair.
    const Vec3 along = grasp.X_OH.linear() * Vec3::UnitX();
    EXPECT_GT(along.cwiseAbs().maxCoeff(), std::cos(std::atan(params.friction_mu)) - 0.05);
  }
  EXPECT_TRUE(scene.place().grasps.empty()) << "no candidate, no grasp: antipodal is asked for by name";
}

TEST(Place, AGripperStraddlesABoxWhereverTheLineIs) {
  Scene scene;
  const Vec3 size(0.04, 0.11, 0.12);  // only its width fits between the pads, 85 mm apart
  scene.scores.mesh = datasets::box(size, 8);
  scene.field = geometry::build_distance_field(scene.scores.mesh, {.cells = 64, .pad_m = 0.04, .refine = 3});
  scene.hand = hands::load_hand("parallel_2f");
  auto& c = scene.scores.candidates[0];
  c.n_O = Vec3::UnitZ();
  c.p_O = Vec3(0.012, 0, size.z() / 2);  // beside the middle: one pad would touch 24 mm before the other
  c.axis_O = Vec3::UnitY();
  PlaceParams params = everything();
  params.measures = true;
  params.approaches = {"normal"};
  params.spreads_rad = {0};
  params.straddle_m = {0.03};
  const auto set = scene.place(params);
  ASSERT_EQ(set.grasps.size(), 2u) << "two rolls of one line, mirror images of each other";
  for (const auto& grasp : set.grasps) {
    // Centred to the 0.02 mm of contact along the line, and 0.1 mm of a field of 1.5 mm cells in flat
    // regions.
    EXPECT_NEAR(grasp.X_OH.translation().x(), 0, 1.5e-4);
    // Pads stop 0.2 mm off each face: both slides have gone (85.4 mm - width) / 2 less that.
    EXPECT_NEAR(grasp.joints_rad.at("left_slide"), (0.0854 - size.x()) / 2 - 0.0002, 3e-4);
    EXPECT_EQ(grasp.scores.at("fingers"), 2);
    EXPECT_NEAR(grasp.scores.at("opposition"), 1, 1e-3) << "flat faces across the jaws' line";
    // Pads end 149.5 mm over the hand's base (URDF), and 30 mm under the box's top.
    EXPECT_NEAR((grasp.X_OH * Vec3(0, 0, 0.1495)).z(), size.z() / 2 - 0.03, 1e-6);
    EXPECT_EQ(grasp.force_closure, "force closure") << "soft pads stop a turn about their line";
  }
  scene.scores.mesh = datasets::box(Vec3(0.1, 0.11, 0.12), 8);
  scene.field = geometry::build_distance_field(scene.scores.mesh, {.cells = 64, .pad_m = 0.04, .refine = 3});
  const auto none = scene.place(params);
  EXPECT_TRUE(none.grasps.empty());
  EXPECT_EQ(none.rejected.at("open hand collides"), 2) << "wider than the gripper opens";
}

TEST(Place, AGripperRefusesFacesThatDoNotFaceEachOther) {
  Scene scene;
  // A wedge, its edge towards the palm.
  auto mesh = datasets::box(Vec3(0.08, 0.08, 0.08), 16);
  for (Vec3& p : mesh.vertices) {
    const double share = (0.04 - p.z()) / 0.08;  // 0 at the top
    p.x() *= 0.05 + 0.95 * share;
  }
  scene.scores.mesh = mesh;
  scene.field = geometry::build_distance_field(mesh, {.cells = 64, .pad_m = 0.04, .refine = 3});
  scene.hand = hands::load_hand("parallel_2f");
  auto& c = scene.scores.candidates[0];
  c.n_O = Vec3::UnitZ();
  c.p_O = Vec3(0, 0, 0.04);
  c.axis_O = Vec3::UnitY();
  PlaceParams params = everything();
  params.approaches = {"normal"};
  params.max_com_offset_m = 0.1;
  // Sides lean by atan(38 / 80) = 25 degrees: inside the cone of mu 0.6 (31), outside that of 0.3 (17).
  EXPECT_FALSE(scene.place(params).grasps.empty());
  params.friction_mu = 0.3;
  const auto set = scene.place(params);
  EXPECT_TRUE(set.grasps.empty());
  EXPECT_GT(set.rejected.at("pads don't face each other"), 0);
}

TEST(Place, RankByFluxPrefersWhatEncloses) {
  Scene scene;
  PlaceParams params = everything();
  params.rank_by = "flux";
  const auto set = scene.place(params);
  ASSERT_GT(set.grasps.size(), 1u);
  for (std::size_t i = 0; i < set.grasps.size(); ++i) {
    EXPECT_GT(set.grasps[i].scores.at("rank"), 0);
    EXPECT_LT(set.grasps[i].scores.at("rank"), 1);
    if (i > 0) {
      EXPECT_GE(set.grasps[i - 1].scores.at("rank"), set.grasps[i].scores.at("rank"));
    }
  }
}

TEST(Place, LaysANetOfPoints) {
  Scene scene;
  scene.hand = hands::load_hand("net_of_points");
  scene.scores.mesh = datasets::icosphere(0.03, 4);
  scene.field = geometry::build_distance_field(scene.scores.mesh, {.cells = 40, .pad_m = 0.03, .refine = 2});
  topology::Candidate& candidate = scene.scores.candidates[0];
  candidate.vertex = 17;
  candidate.p_O = scene.scores.mesh.vertices[17];
  candidate.n_O = candidate.p_O.normalized();
  candidate.radius_m = 0.085;
  const auto set = scene.place();
  ASSERT_EQ(set.grasps.size(), 1u);
  EXPECT_EQ(set.grasps[0].scores.at("blocked_share"), 1);
  EXPECT_TRUE(set.grasps[0].joints_rad.empty());
  EXPECT_GT(set.grasps[0].points_O.size(), 100u);
  const tests::ScratchFolder folder;
  save_artefact(set, folder.path());
  hands::GraspSet read;
  load_artefact(read, folder.path());
  EXPECT_EQ(read.grasps.at(0).points_O, set.grasps[0].points_O);
  candidate.radius_m = 0.01;
  EXPECT_EQ(scene.place().rejected.at("leaves a way out"), 1);
}

TEST(Place, GivesTheSameBytesForAnyNumberOfThreads) {
  const auto bytes = [](int threads) {
    omp_set_num_threads(threads);
    Scene scene;
    for (double height : {0.005, 0.01, 0.015})
      scene.scores.candidates.push_back(Scene::candidate(height, "curvature"));
    const tests::ScratchFolder folder;
    save_artefact(scene.place({.max_per_candidate = 3}), folder.path());
    std::string text;
    for (const char* file : {"grasps.json", "rejected.json"}) {
      std::ifstream in(folder / file, std::ios::binary);
      text.append(std::istreambuf_iterator<char>(in), {});
    }
    return text;
  };
  const std::string one = bytes(1);
  EXPECT_GT(one.size(), 1000u);
  EXPECT_EQ(one, bytes(2));
  EXPECT_EQ(one, bytes(5));
}

TEST(Place, FindsHoldsOnAScannedMug) {
  const char* objects = std::getenv("GEOCAGE_TEST_OBJECTS");
  if (!objects) GTEST_SKIP() << "GEOCAGE_TEST_OBJECTS names no folder of meshes";
  Scene scene;
  scene.scores.mesh = geometry::read_mesh(std::filesystem::path(objects) / "mug.stl");
  scene.field = geometry::build_distance_field(scene.scores.mesh, {});
  const auto normals = geometry::vertex_normals(scene.scores.mesh);
  const Vec3 center = geometry::mass_properties(scene.scores.mesh).center;
  scene.scores.candidates.clear();
  for (std::size_t v = 0; v < normals.size(); v += normals.size() / 12) {
    auto candidate = Scene::candidate(0, "curvature");
    candidate.p_O = scene.scores.mesh.vertices[v];
    candidate.n_O = normals[v];
    candidate.center_O = center;
    scene.scores.candidates.push_back(candidate);
  }
  const auto set = scene.place();
  EXPECT_EQ(scene.run.metrics().at("poses"), sum(set.rejected) + static_cast<double>(set.grasps.size()));
  ASSERT_FALSE(set.grasps.empty());
  for (const auto& grasp : set.grasps)
    for (const auto& capsule : scene.capsules(grasp, grasp.joints_rad))
      for (int i = 0; i <= 40; ++i)  // unsigned distance by brute force: thin walls have no deep inside
        EXPECT_GT(geometry::brute_force_distance_m(scene.scores.mesh,
                                                   capsule.a + i / 40.0 * (capsule.b - capsule.a)),
                  capsule.radius_m - 0.001);
}

}  // namespace
}  // namespace geocage::stages
