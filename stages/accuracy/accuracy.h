#pragma once
#include "geometry/accuracy.h"
#include "pipeline/stage.h"

namespace geocage::stages {

struct AccuracyParams {
  double sampling = 0.005;
  void visit(pipeline::Fields& f);
};

/// Distances, genus and soundness of a surface against the true one, where that is known (`scan` made the
/// cloud). Metrics: `hausdorff_m`, `mean_m`, `hausdorff`, `mean` (in diagonals), `genus`, `genus_kept`,
/// `solid`, `observed_mean_m`, `guessed_mean_m`, `observed_share`.
geometry::Accuracy accuracy(const AccuracyParams& params, pipeline::Run& run,
                            const geometry::TriangleMesh& surface, const geometry::TriangleMesh& truth);

inline constexpr pipeline::Stage accuracy_stage{"accuracy", 1, &accuracy};

}  // namespace geocage::stages
