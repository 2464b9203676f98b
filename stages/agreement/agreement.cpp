#include "stages/agreement/agreement.h"

#include <cmath>

namespace geocage::stages {

void AgreementParams::visit(pipeline::Fields& f) {
  f("reference", reference, {"none", "clean", "truth"},
    "compare scores with nothing, with those of the mesh before `noise`, or of the true mesh");
  f("top_share", top_share, {0.001, 1}, "the best vertices whose overlap is measured");
}

topology::ScoreAgreement agreement(const AgreementParams& params, pipeline::Run& run,
                                   const topology::Scores& clean, const topology::Scores& noisy) {
  auto found = topology::agreement_of(clean, noisy, params.top_share);
  const auto tell = [&](const std::string& name, double value) {
    if (std::isfinite(value)) run.metric(name, value);
  };
  for (const auto& one : found.fields) {
    tell(one.field + "_rank_correlation", one.rank_correlation);
    tell(one.field + "_top_overlap", one.top_overlap);
    tell(one.field + "_drift_m", one.drift_m);
    if (found.radius_m > 0) tell(one.field + "_drift_radii", one.drift_m / found.radius_m);
  }
  run.metric("same_vertices", found.same_vertices);
  run.metric("gap_m", found.gap_m);
  run.metric("radius_m", found.radius_m);
  run.metric("noisy_radius_m", found.noisy_radius_m);
  return found;
}

}  // namespace geocage::stages
