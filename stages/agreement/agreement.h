#pragma once
#include "pipeline/stage.h"
#include "topology/score_agreement.h"

namespace geocage::stages {

struct AgreementParams {
  std::string reference = "none";
  double top_share = 0.1;
  void visit(pipeline::Fields& f);
};

/// How the scores of a noisy mesh agree with those of the clean one (topology/score_agreement.h). Metrics of
/// both fields: `winding_rank_correlation`, `winding_top_overlap`, `winding_drift_m`, `winding_drift_radii`
/// (of the clean ball), `curvature_...`; what has no value is left out.
topology::ScoreAgreement agreement(const AgreementParams& params, pipeline::Run& run,
                                   const topology::Scores& clean, const topology::Scores& noisy);

inline constexpr pipeline::Stage agreement_stage{"agreement", 2, &agreement};

}  // namespace geocage::stages
