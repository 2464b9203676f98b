#include "stages/place/place.h"

#include <algorithm>

#include "stages/place/pose_search.h"

namespace geocage::stages {

void PlaceParams::visit(pipeline::Fields& fields) {
  fields("object", object, {}, "name of the object in grasp files; empty: the flow's");
  fields("approaches", approaches, {"normal", "center"},
         "directions the palm comes from: against the normal, or towards the ball's centre across its axis");
  fields("gaps_m", gaps_m, {0, 0.2},
         "how far the hand is backed off from the first contact of palm or knuckles");
  fields("rolls_winding", rolls_winding, {1, 64},
         "turns about the approach for candidates of the winding angle");
  fields("rolls_curvature", rolls_curvature, {1, 64}, "turns about the approach for all other candidates");
  fields("spreads_rad", spreads_rad, {-3.2, 3.2}, "spreads of the fingers, clamped to the joint's limits");
  fields("opening_step_rad", opening_step_rad, {0.01, 1},
         "how much a hand that collides is opened at a time");
  fields("open_clearance_m", open_clearance_m, {0, 0.1}, "free space around the open hand");
  fields("support_clearance_m", support_clearance_m, {-0.1, 0.1},
         "free space between hand and support, all the while");
  fields("max_lift_m", max_lift_m, {0, 1}, "how far a hand that comes too near the support is lifted off it");
  fields("max_com_offset_m", max_com_offset_m, {0, 10},
         "largest distance of the centre of mass from the approach line");
  fields("min_fingers", min_fingers, {1, 16}, "fingers that must touch, at most all of the hand");
  fields("max_penetration_m", max_penetration_m, {0, 0.01},
         "how deep the closed hand may be inside the object");
  fields("min_blocked_share", min_blocked_share, {0, 1},
         "least share of straight ways out that the closed hand blocks");
  fields("max_per_candidate", max_per_candidate, {1, 1000}, "grasps kept of one candidate");
  fields("max_grasps", max_grasps, {1, 100000}, "grasps kept of all");
}

namespace {

/// Best first; equals stay in the order they were found. What is beyond `most` is counted as outranked.
void keep_best(std::vector<hands::Grasp>& grasps, int most, std::map<std::string, int>& rejected) {
  std::stable_sort(grasps.begin(), grasps.end(), [](const hands::Grasp& a, const hands::Grasp& b) {
    return a.scores.at("rank") > b.scores.at("rank");
  });
  const int outranked = static_cast<int>(grasps.size()) - most;
  if (outranked <= 0) return;
  grasps.resize(most);
  rejected["outranked"] += outranked;
}

}  // namespace

hands::GraspSet place(const PlaceParams& params, pipeline::Run& run, const topology::Scores& scores,
                      const geometry::SignedDistanceField& field, const geometry::PointCloud& support_cloud,
                      const hands::Hand& hand) {
  const auto center_of_mass_O = geometry::mass_properties(scores.mesh).center;
  const PoseSearch search(params, field, support_cloud.support, center_of_mass_O, hand);
  std::vector<CandidatePoses> found(scores.candidates.size());
  std::size_t done = 0;
#pragma omp parallel for schedule(dynamic, 1)
  for (std::size_t i = 0; i < found.size(); ++i) {
    found[i] = search.search(scores.candidates[i], scores.ball.radius_m);
    keep_best(found[i].grasps, params.max_per_candidate, found[i].rejected);
#pragma omp critical
    run.progress(++done, found.size());
  }

  hands::GraspSet set;
  int poses = 0;
  for (CandidatePoses& candidate : found) {
    poses += candidate.tried;
    std::move(candidate.grasps.begin(), candidate.grasps.end(), std::back_inserter(set.grasps));
    for (const auto& [rule, count] : candidate.rejected) set.rejected[rule] += count;
  }
  keep_best(set.grasps, params.max_grasps, set.rejected);
  run.metric("poses", poses);
  run.metric("grasps", static_cast<double>(set.grasps.size()));
  for (const auto& [rule, count] : set.rejected) run.metric("rejected: " + rule, count);
  return set;
}

}  // namespace geocage::stages
