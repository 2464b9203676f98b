#include "stages/noise/noise.h"

#include <algorithm>
#include <cmath>

#include "geometry/noise.h"
#include "pipeline/error.h"

namespace geocage::stages {

void NoiseParams::visit(pipeline::Fields& f) {
  f("sigma_edges", sigma_edges, {0, 10}, "deviation of the noise in mean edge lengths of the mesh");
  f("sigma_m", sigma_m, {0, 1}, "or in metres");
  f("direction", direction, {"normal", "isotropic"}, "along the vertices' normals, or in every direction");
  f("surface", surface, {"reconstruction", "truth"},
    "what is remeshed and made noisy; truth leaves the reconstruction out");
  f("seed", seed, "of the noise");
}

geometry::TriangleMesh noise(const NoiseParams& params, pipeline::Run& run,
                             const geometry::TriangleMesh& mesh) {
  if (params.sigma_edges > 0 && params.sigma_m > 0)
    throw pipeline::UserError(pipeline::Fault::configuration, "noise.sigma_m", "the noise has two deviations",
                              "say sigma_edges or sigma_m, not both");
  const double edge_m = geometry::mean_edge_m(mesh);
  const double sigma_m = params.sigma_m > 0 ? params.sigma_m : params.sigma_edges * edge_m;
  const auto direction =
      params.direction == "normal" ? geometry::NoiseDirection::normal : geometry::NoiseDirection::isotropic;
  auto noisy = geometry::with_vertex_noise(mesh, sigma_m, direction, params.seed);
  double sum2 = 0, most = 0;
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    const double d = (noisy.vertices[v] - mesh.vertices[v]).norm();
    sum2 += d * d;
    most = std::max(most, d);
  }
  run.metric("sigma_m", sigma_m);
  run.metric("mean_edge_m", edge_m);
  run.metric("moved_rms_m",
             std::sqrt(sum2 / static_cast<double>(std::max<std::size_t>(1, mesh.vertices.size()))));
  run.metric("moved_max_m", most);
  return noisy;
}

}  // namespace geocage::stages
