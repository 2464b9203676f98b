#pragma once
#include "geometry/mesh.h"
#include "pipeline/stage.h"

namespace geocage::stages {

struct RemeshParams {
  double edge_length_m = 0.004;
  int sweeps = 5;
  std::uint64_t seed = 1;
  void visit(pipeline::Fields& f);
};

/// Near-equilateral triangles of one edge length on the same surface (Botsch and Kobbelt 2004: split,
/// collapse, flip, smooth, project; by CGAL). Precondition: closed manifold. Errors: UserError
/// (configuration) for an edge length that doesn't suit the object's size; UserError (geometry) when the
/// result is not closed, changes its genus, or cuts itself (triangles named).
geometry::TriangleMesh remesh(const RemeshParams& params, pipeline::Run& run,
                              const geometry::TriangleMesh& mesh);

inline constexpr pipeline::Stage remesh_stage{"remesh", 1, &remesh};

}  // namespace geocage::stages
