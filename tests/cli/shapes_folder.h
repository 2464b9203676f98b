#pragma once
#include <fstream>

#include "datasets/shapes.h"
#include "geometry/mesh.h"
#include "tests/pipeline/scratch_folder.h"

namespace geocage::tests {

/// A flow file for a bottle-like cylinder that runs in seconds: few views, coarse mesh, two grasps.
inline std::filesystem::path quick_flow(const ScratchFolder& folder, const std::string& more = "") {
  geometry::write_ply(folder / "bottle.ply", datasets::capped_cylinder(0.025, 0.14, 48));
  const auto file = folder / "flow.toml";
  std::ofstream(file) << "objects = ['" << (folder / "bottle.ply").string() << "']\nhands = ['schunk_sdh']\n"
                      << "[scan]\nviews = 4\nwidth = 160\nheight = 120\n[remesh]\nedge_length_m = 0.006\n"
                      << "[field]\ncells = 32\n[place]\nmax_grasps = 2\n"
                      << more;
  return file;
}

}  // namespace geocage::tests
