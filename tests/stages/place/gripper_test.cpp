#include "stages/place/gripper.h"

#include <algorithm>

#include <gtest/gtest.h>

#include "datasets/shapes.h"
#include "hands/caging.h"
#include "stages/place/antipodal.h"
#include "stages/place/place.h"

namespace geocage::stages {
namespace {

using geometry::Pose;
using geometry::Vec3;

constexpr double width_m = 0.05, pad_m = 0.0427;  // pads open stand that far from the middle (URDF)

/// A box that the gripper comes down on from above, its jaws closing along x, `aside_m` off the middle.
struct BoxScene {
  topology::Scores scores;
  geometry::SignedDistanceField field;
  hands::Hand hand = hands::load_hand("parallel_2f");
  PlaceParams params;
  pipeline::Run run;

  explicit BoxScene(double aside_m) {
    scores.mesh = datasets::box(Vec3(width_m, 0.08, 0.06), 8);
    scores.ball.radius_m = 0.04;
    topology::Candidate candidate;
    candidate.heuristic = "winding";
    candidate.p_O = Vec3(aside_m, 0, 0.03);
    candidate.n_O = Vec3::UnitZ();
    candidate.center_O = Vec3(aside_m, 0, 0);
    candidate.axis_O = Vec3::UnitY();
    scores.candidates = {candidate};
    field = geometry::build_distance_field(scores.mesh, {.cells = 48, .pad_m = 0.03, .refine = 2});
    params.approaches = {"normal"};
    params.straddle_m = {0.03};
    params.max_per_candidate = params.max_grasps = 10;
  }

  hands::GraspSet place() { return stages::place(params, run, scores, field, {}, {}, hand); }

  std::vector<hands::Contact> contacts(const hands::Grasp& grasp) const {
    const auto placed =
        hands::placed_capsules(hand, grasp.X_OH, hands::joint_vector(hand.tree, grasp.joints_rad, "test"));
    return hands::contacts_of(hand, field, placed, hands::ClosingRule{}.contact_m);
  }
};

TEST(Gripper, HoldsABoxBetweenOppositeFacesWhereverItComesFrom) {
  for (double aside_m : {0.0, 0.012, -0.012}) {
    BoxScene scene(aside_m);
    const auto set = scene.place();
    ASSERT_FALSE(set.grasps.empty()) << aside_m;
    for (const auto& grasp : set.grasps) {
      // Jaws close until the first is 0.2 mm off; the field is right to 0.1 mm, centring to 0.02 mm.
      EXPECT_NEAR(pad_m - grasp.joints_rad.at("left_slide"), width_m / 2, 0.0004);
      EXPECT_NEAR(grasp.X_OH.translation().x(), 0, 0.0002) << "the hand is over the middle";
      EXPECT_NEAR(grasp.X_OH.translation().y(), 0, 1e-9) << "and was moved along the jaws' line only";
      const auto contacts = scene.contacts(grasp);
      ASSERT_EQ(contacts.size(), 2u);
      // Flat faces: trilinear gradients are exact there but for the float's rounding over a cell, 1e-5.
      EXPECT_LT((contacts[0].n_O + contacts[1].n_O).norm(), 1e-4) << "normals are antiparallel";
      EXPECT_NEAR(std::abs(contacts[0].n_O.x()), 1, 1e-4);
      // Each contact point lies on its face: the field's 0.1 mm.
      EXPECT_NEAR((contacts[0].p_O - contacts[1].p_O).cwiseAbs().x(), width_m, 0.0002);
      EXPECT_LT((contacts[0].p_O - contacts[1].p_O).tail<2>().norm(), 0.0375) << "opposite, within a pad";
    }
  }
}

TEST(Gripper, PairsFartherApartThanItsJawsOpenAreLeftOut) {
  const auto gripper = gripper_of(hands::load_hand("parallel_2f"));
  ASSERT_TRUE(gripper);
  EXPECT_NEAR(gripper->opening_m, 2 * pad_m, 1e-9);
  topology::Scores scores;
  scores.mesh = datasets::box(Vec3(width_m, 0.1, 0.12), 8);  // only the width fits
  PlaceParams params;
  params.antipodal_places = 1000;
  const auto across = [](const topology::Candidate& c) { return std::abs(c.axis_O.cross(c.n_O).x()) > 0.5; };
  const auto all = antipodal_candidates(params, scores, 1);
  EXPECT_FALSE(std::all_of(all.begin(), all.end(), across)) << "without the bound, other faces are paired";
  const auto fit = antipodal_candidates(params, scores, gripper->opening_m);
  ASSERT_FALSE(fit.empty());
  EXPECT_TRUE(std::all_of(fit.begin(), fit.end(), across));
}

}  // namespace
}  // namespace geocage::stages
