#include "stages/field/field.h"

#include "pipeline/error.h"

namespace geocage::stages {

void FieldParams::visit(pipeline::Fields& f) {
  f("cells", cells, {8, 512}, "coarse cells along the longest side of the padded box");
  f("pad_m", pad_m, {0.001, 1}, "free border around the surface; at least the thickness of a finger");
  f("refine", refine, {1, 15}, "fine cells along a coarse cell that the surface may cross, at least");
  f("error_m", error_m, {0, 0.01},
    "about how far interpolation may err outside, near the surface: cells that do worse are parted; 0: none "
    "is");
  f("near_m", near_m, {0, 1}, "how far from the surface that counts");
  f("inside_error_m", inside_error_m, {0, 0.01}, "the same for points inside; 0: they don't matter");
}

geometry::SignedDistanceField field(const FieldParams& params, pipeline::Run& run,
                                    const geometry::TriangleMesh& mesh) {
  const auto report = geometry::check_mesh(mesh);
  if (!report.closed_manifold())
    throw pipeline::UserError(pipeline::Fault::geometry, "field",
                              "inside and outside need a closed manifold: " + flaw(report));
  auto field = geometry::build_distance_field(mesh, {params.cells, params.pad_m, params.refine,
                                                     params.error_m, params.near_m, params.inside_error_m});
  run.metric("cell_m", field.cell_m);
  run.metric("finest_cell_m", field.finest_cell_m());
  run.metric("nodes", static_cast<double>(field.coarse.size() + field.fine.size()));
  return field;
}

}  // namespace geocage::stages
