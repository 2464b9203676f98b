#pragma once
#include "geometry/mesh.h"
#include "pipeline/stage.h"

namespace geocage::stages {

struct RemeshParams {
  std::string size_by = "edge_length";
  double edge_length_m = 0.004;
  int vertices = 5000;
  int sweeps = 5;
  double least_angle_deg = 25;
  void visit(pipeline::Fields& f);
};

/// Near-equilateral triangles of one edge length on the same surface (isotropic.h), with `observed` carried
/// over. Precondition: closed manifold. Answers a closed manifold of the same Euler number that doesn't cut
/// itself and has no angle below `least_angle_deg`; where edges can't follow the surface, one on an alpha
/// wrap round it, of maybe another Euler number: the metric `wrap_alpha_m` is not 0 then. Metrics say how far
/// it lies from the input. Errors: UserError (configuration) for a size that doesn't suit the object;
/// UserError (geometry) when the input is not a closed manifold or the result is not what was promised
/// (elements named). About 1 s for 20000 vertices.
geometry::TriangleMesh remesh(const RemeshParams& params, pipeline::Run& run,
                              const geometry::TriangleMesh& mesh);

inline constexpr pipeline::Stage remesh_stage{"remesh", 4, &remesh};

}  // namespace geocage::stages
