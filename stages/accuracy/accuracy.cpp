#include "stages/accuracy/accuracy.h"

namespace geocage::stages {

void AccuracyParams::visit(pipeline::Fields& f) {
  f("sampling", sampling, {0.0005, 0.1},
    "no point of a surface is farther from a sample, in diagonals of the true surface's box");
}

geometry::Accuracy accuracy(const AccuracyParams& params, pipeline::Run& run,
                            const geometry::TriangleMesh& surface, const geometry::TriangleMesh& truth) {
  const double diagonal_m = geometry::check_mesh(truth).diagonal_m();
  const auto found = geometry::accuracy_of(surface, truth, params.sampling * diagonal_m);
  run.metric("hausdorff_m", found.hausdorff_m());
  run.metric("mean_m", found.mean_m());
  run.metric("hausdorff", found.hausdorff_m() / diagonal_m);
  run.metric("mean", found.mean_m() / diagonal_m);
  run.metric("genus", found.genus);
  run.metric("genus_kept", found.genus == found.true_genus);
  run.metric("solid", found.solid);
  run.metric("observed_mean_m", found.observed_mean_m);
  run.metric("guessed_mean_m", found.guessed_mean_m);
  run.metric("observed_share", found.observed_share);
  return found;
}

}  // namespace geocage::stages
