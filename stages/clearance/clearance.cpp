#include "stages/clearance/clearance.h"

namespace geocage::stages {

void ClearanceParams::visit(pipeline::Fields& f) {
  f("unknown", unknown, {"open", "solid"}, "what space that no ray has passed counts as");
  f("pad_m", pad_m, {0, 10}, "border of the grid around the occupied cells");
}

geometry::SignedDistanceField clearance(const ClearanceParams& params, pipeline::Run& run,
                                        const geometry::Occupancy& map) {
  auto field = geometry::clearance_field(map, {params.unknown == "solid", params.pad_m});
  run.metric("nodes", static_cast<double>(field.coarse.size()));
  return field;
}

}  // namespace geocage::stages
