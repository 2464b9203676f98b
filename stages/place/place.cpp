#include "stages/place/place.h"

#include <algorithm>
#include <limits>

#include "pipeline/each_item.h"
#include "pipeline/error.h"
#include "stages/place/antipodal.h"
#include "stages/place/net_search.h"
#include "stages/place/pose_search.h"

namespace geocage::stages {

void PlaceParams::visit(pipeline::Fields& fields) {
  fields("object", object, {}, "name of the object in grasp files; empty: the flow's");
  fields("heuristics", heuristics, {"winding", "curvature", "combined", "loops", "random", "antipodal"},
         "whose candidates are used; none named: all that were scored. antipodal finds its own");
  fields("antipodal_places", antipodal_places, {1, 1000},
         "opposed pairs of points, each approached from 8 sides")
      .only_with("heuristics", {"antipodal"});
  fields("approaches", approaches, {"normal", "center"},
         "directions the palm comes from: against the normal, or towards the ball's centre across its axis");
  fields("align_plane", align_plane, "roll 0 lets the fingers close in the ball's plane; off: a random turn");
  fields("gaps_m", gaps_m, {0, 0.2},
         "how far the hand is backed off from the first contact of palm or knuckles");
  fields("straddle_m", straddle_m, {-0.1, 0.2},
         "of a gripper, in place of gaps: how far its pads reach behind the surface");
  fields("rolls_winding", rolls_winding, {1, 64},
         "turns about the approach for candidates that are rings or pairs");
  fields("rolls_curvature", rolls_curvature, {1, 64}, "turns about the approach for all other candidates");
  fields("spreads_rad", spreads_rad, {-3.2, 3.2}, "spreads of the fingers, clamped to the joint's limits");
  fields("spread_by_shape", spread_by_shape,
         "spread 0 for rings and long balls (variances 2 : 1), 0.5 for others, in place of the list");
  fields("opening_step_rad", opening_step_rad, {0.01, 1},
         "how much a hand that collides is opened at a time");
  fields("max_opening_rad", max_opening_rad, {0, 3.2},
         "how much at most; 0: it stays as its description opens it");
  fields("open_clearance_m", open_clearance_m, {0, 0.1}, "free space around the open hand");
  fields("local_samples", local_samples, {0, 100000},
         "poses drawn around each candidate's lines; 0: none, 150: a search");
  fields("local_offset_m", local_offset_m, {0, 0.1}, "how far a drawn pose may be moved sideways");
  fields("local_tilt_rad", local_tilt_rad, {0, 1.5}, "how far it may be tilted");
  fields("local_rolls", local_rolls, {1, 64}, "turns about the approach that are drawn from");
  fields("local_spreads_rad", local_spreads_rad, {-3.2, 3.2}, "spreads that are drawn from");
  fields("local_openings_rad", local_openings_rad, {0, 3.2},
         "further openings of the first joints that are drawn from");
  fields("closing_order", closing_order, {"hand", "proximal_first", "together", "breakaway"},
         "which joints close first: as the hand's description says, or one for all");
  fields("support_clearance_m", support_clearance_m, {-0.1, 0.1},
         "free space between hand and support, all the while");
  fields("max_lift_m", max_lift_m, {0, 1}, "how far a hand that comes too near the support is lifted off it");
  fields("max_com_offset_m", max_com_offset_m, {0, 10},
         "largest distance of the centre of mass from the approach line");
  fields("min_observed", min_observed, {0, 1},
         "how surely the surface at a candidate must have been observed");
  fields("max_reach_m", max_reach_m, {0, 100},
         "farthest that the hand's base may be from reach_from_m; 0: no limit");
  fields("reach_from_m", reach_from_m, {-100, 100}, "where an arm stands, x y z in the object's frame");
  fields("min_fingers", min_fingers, {1, 16}, "fingers that must touch, at most all of the hand");
  fields("max_penetration_m", max_penetration_m, {0, 0.01},
         "how deep the closed hand may be inside the object");
  fields("escape_m", escape_m, {0.001, 1}, "a straight way out is free when the object gets this far");
  fields("min_blocked_share", min_blocked_share, {0, 1},
         "least share of straight ways out that the closed hand blocks");
  fields("rank_by", rank_by, {"cage", "flux"},
         "blocked share and closure margin, or the share of the object's field lines that the hand catches");
  fields("margin_weight", margin_weight, {0, 100}, "of the closure margin beside the blocked share");
  fields("max_per_candidate", max_per_candidate, {1, 1000}, "grasps kept of one candidate");
  fields("max_grasps", max_grasps, {1, 100000}, "grasps kept of all");
  fields("measures", measures,
         "wrap, enclosure, linking, flux and force closure of the grasps that are kept");
  fields("friction_mu", friction_mu, {0, 10}, "Coulomb friction of force closure");
  fields("friction_edges", friction_edges, {3, 64}, "edges of the pyramid in place of the friction cone");
  fields("seed", seed, "of drawn poses");
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

/// The candidates whose heuristic is asked for, and those that placing finds itself.
std::vector<topology::Candidate> candidates_of(const PlaceParams& params, const topology::Scores& scores,
                                               const hands::Hand& hand) {
  const auto asked = [&](const std::string& name) {
    return std::find(params.heuristics.begin(), params.heuristics.end(), name) != params.heuristics.end();
  };
  std::vector<topology::Candidate> candidates;
  for (const topology::Candidate& candidate : scores.candidates)
    if (params.heuristics.empty() || asked(candidate.heuristic)) candidates.push_back(candidate);
  if (!asked("antipodal")) return candidates;
  const auto gripper = gripper_of(hand);
  const double widest_m = gripper ? gripper->opening_m : std::numeric_limits<double>::infinity();
  for (auto& candidate : antipodal_candidates(params, scores, widest_m))
    candidates.push_back(std::move(candidate));
  return candidates;
}

}  // namespace

hands::GraspSet place(const PlaceParams& params, pipeline::Run& run, const topology::Scores& scores,
                      const geometry::SignedDistanceField& field, const geometry::PointCloud& support_cloud,
                      const geometry::SignedDistanceField& others, const hands::Hand& hand) {
  if (params.reach_from_m.size() != 3)
    throw pipeline::UserError(pipeline::Fault::configuration, "place.reach_from_m",
                              "is not a list of three numbers");
  const auto candidates = candidates_of(params, scores, hand);
  const PoseSearch search(params, scores, field, support_cloud.support, others, hand);
  std::vector<CandidatePoses> found(candidates.size());
  std::size_t done = 0;
  pipeline::for_each_item(found.size(), [&](std::size_t i) {
    found[i] = hand.net ? lay_net(params, scores, field, hand, candidates[i]) : search.search(candidates[i]);
    keep_best(found[i].grasps, params.max_per_candidate, found[i].rejected);
    for (hands::Grasp& grasp : found[i].grasps) grasp.scores["candidate"] = static_cast<double>(i);
#pragma omp critical
    run.progress(++done, found.size());
  });

  hands::GraspSet set;
  int poses = 0;
  for (CandidatePoses& of_one : found) {
    poses += of_one.tried;
    std::move(of_one.grasps.begin(), of_one.grasps.end(), std::back_inserter(set.grasps));
    for (const auto& [rule, count] : of_one.rejected) set.rejected[rule] += count;
  }
  keep_best(set.grasps, params.max_grasps, set.rejected);
  pipeline::for_each_item(set.grasps.size(), [&](std::size_t i) {
    if (params.measures && !hand.net)
      search.measure(set.grasps[i],
                     candidates[static_cast<std::size_t>(set.grasps[i].scores.at("candidate"))]);
  });
  run.metric("poses", poses);
  run.metric("grasps", static_cast<double>(set.grasps.size()));
  for (const auto& [rule, count] : set.rejected) run.metric("rejected: " + rule, count);
  return set;
}

}  // namespace geocage::stages
