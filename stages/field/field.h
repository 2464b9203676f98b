#pragma once
#include "geometry/distance_field.h"
#include "pipeline/stage.h"

namespace geocage::stages {

struct FieldParams {
  int cells = 64;
  double pad_m = 0.04;
  int refine = 3;
  double error_m = 2.5e-4, near_m = 0.005, inside_error_m = 4e-4;
  void visit(pipeline::Fields& f);
};

/// Signed distance to a surface, for closing, planning and physics (stages/field/README.md).
/// Errors: UserError (geometry) when the mesh is not a closed manifold.
geometry::SignedDistanceField field(const FieldParams& params, pipeline::Run& run,
                                    const geometry::TriangleMesh& mesh);

inline constexpr pipeline::Stage field_stage{"field", 4, &field};

}  // namespace geocage::stages
