#pragma once
#include "geometry/mesh.h"
#include "pipeline/stage.h"

namespace geocage::stages {

struct NoiseParams {
  double sigma_edges = 0;
  double sigma_m = 0;
  std::string direction = "normal";
  std::string surface = "reconstruction";
  std::uint64_t seed = 1;
  void visit(pipeline::Fields& f);

  bool asked() const { return sigma_edges > 0 || sigma_m > 0; }
};

/// The mesh with every vertex moved by Gaussian noise (geometry/noise.h), connectivity kept: the thesis's
/// test of how robust the scores are (7.6). Errors: UserError (configuration) when both sigmas are given.
geometry::TriangleMesh noise(const NoiseParams& params, pipeline::Run& run,
                             const geometry::TriangleMesh& mesh);

inline constexpr pipeline::Stage noise_stage{"noise", 1, &noise};

}  // namespace geocage::stages
