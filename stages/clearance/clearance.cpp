#include "stages/clearance/clearance.h"

namespace geocage::stages {

void ClearanceParams::visit(pipeline::Fields& f) {
  f("unknown", unknown, {"open", "solid"}, "what space that no ray has passed counts as");
  f("pad_m", pad_m, {0, 10}, "border of the grid around the occupied cells");
  f("near_cells", near_cells, {0, 100},
    "cells up to so many sides from the surface or the support are its own");
  f("noise_deviations", noise_deviations, {0, 100},
    "and so many standard deviations of the seen points further");
  f("noise_reach_m", noise_reach_m, {0, 1}, "points further off than this are no measure of that");
  f("least_cells", least_cells, {1, 1000000}, "smaller groups of neighbouring cells are stray");
}

geometry::SignedDistanceField clearance(const ClearanceParams& params, pipeline::Run& run,
                                        const geometry::Occupancy& map, const geometry::PointCloud& cloud,
                                        const geometry::SignedDistanceField& field) {
  const auto others = geometry::other_cells(
      map, field, cloud,
      {params.near_cells, params.noise_deviations, params.noise_reach_m, params.least_cells});
  run.metric("foreign_cells", static_cast<double>(others.centers_O.size()));
  run.metric("cells_of_object", static_cast<double>(others.of_object));
  run.metric("cells_of_support", static_cast<double>(others.of_support));
  run.metric("stray_cells", static_cast<double>(others.stray));
  run.metric("point_deviation_m", others.deviation_m);
  auto answer =
      geometry::clearance_of_others(map, others, field, cloud, {params.unknown == "solid", params.pad_m});
  run.metric("nodes", static_cast<double>(answer.coarse.size()));
  return answer;
}

}  // namespace geocage::stages
