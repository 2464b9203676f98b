#include "stages/place/net_search.h"

#include "hands/caging.h"
#include "hands/net.h"

namespace geocage::stages {

CandidatePoses lay_net(const PlaceParams& params, const topology::Scores& scores,
                       const geometry::SignedDistanceField& field, const hands::Hand& hand,
                       const topology::Candidate& candidate) {
  CandidatePoses poses;
  poses.tried = 1;
  const auto rejected = [&](const char* rule) {
    poses.rejected[rule] = 1;
    return poses;
  };
  const auto& observed = scores.mesh.observed;
  if (!observed.empty() && observed[candidate.vertex] < params.min_observed)
    return rejected("never observed");
  const hands::Net net =
      hands::tighten_net(hand, scores.mesh, field, candidate.vertex, candidate.radius_m, -candidate.n_O);
  if (net.penetration_m > params.max_penetration_m) return rejected("penetrates");
  const double blocked = hands::blocked_share(field, hands::net_capsules(net), params.escape_m);
  if (blocked < params.min_blocked_share) return rejected("leaves a way out");
  hands::Grasp grasp;
  grasp.hand = hand.name;
  grasp.object = params.object;
  grasp.heuristic = candidate.heuristic;
  grasp.points_O = net.points_O;
  const double margin = hands::closure_margin(net.contacts);
  grasp.scores = {{"rank", blocked + params.margin_weight * margin},
                  {"blocked_share", blocked},
                  {"closure_margin", margin},
                  {"contacts", static_cast<double>(net.contacts.size())},
                  {"penetration_m", net.penetration_m},
                  {"stretch", net.stretch},
                  {"score", candidate.score},
                  {"vertex", candidate.vertex},
                  {"winding_angle_rad", candidate.winding_angle_rad},
                  {"curvature_sum_rad", candidate.curvature_sum_rad},
                  {"euler", candidate.euler},
                  {"ball_radius_m", candidate.radius_m}};
  poses.grasps.push_back(std::move(grasp));
  return poses;
}

}  // namespace geocage::stages
