#pragma once
#include "pipeline/stage.h"
#include "topology/scores.h"

namespace geocage::stages {

struct ScoreParams {
  double radius_m = 0;
  std::vector<std::string> heuristics = {"winding", "curvature"};
  int max_candidates = 12;
  int min_candidates = 3;
  double spacing_m = 0.015;
  double com_offset_m = 0.02;
  double most_share = 0.5;
  double winding_min_rad = 0, winding_max_rad = 7;  // neutral: winding angles lie in [pi, 2 pi]
  std::string beside = "none";
  bool necks = false;
  std::uint64_t seed = 1;
  void visit(pipeline::Fields& f);
};

/// Where to place a hand: the best vertices by each heuristic, spread over the surface
/// (stages/score/README.md). Errors: UserError (configuration) when no ball has the asked radius. No
/// candidate is a value, not an error.
topology::Scores score(const ScoreParams& params, pipeline::Run& run, const geometry::TriangleMesh& mesh,
                       const topology::BallSet& balls);

inline constexpr pipeline::Stage score_stage{"score", 5, &score};

}  // namespace geocage::stages
