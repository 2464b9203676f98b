#include "stages/occupancy/occupancy.h"

namespace geocage::stages {

void OccupancyParams::visit(pipeline::Fields& f) {
  f("resolution_m", resolution_m, {0.0005, 0.5}, "side of the smallest cell");
  f("least_end_share", least_end_share, {0, 1},
    "of a view's rays into a cell, so many have to end there to occupy it");
}

geometry::Occupancy occupancy(const OccupancyParams& params, pipeline::Run& run,
                              const geometry::PointCloud& cloud) {
  auto map = geometry::map_of_rays(cloud, params.resolution_m, params.least_end_share);
  const auto cells = geometry::count_cells(map);
  run.metric("free_cells", static_cast<double>(cells.free));
  run.metric("occupied_cells", static_cast<double>(cells.occupied));
  return map;
}

}  // namespace geocage::stages
