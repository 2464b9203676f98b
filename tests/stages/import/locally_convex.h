#pragma once
#include <filesystem>

#include "geometry/scene.h"

namespace geocage::tests {

/// What PCL's LCCPSegmentation (Stein et al. 2014) makes of a table scene, with the parameters of PCL's
/// example: voxels of 7.5 mm, supervoxels of 3 cm, a concavity tolerance of 10 degrees. Table and what stands
/// on it are found as import finds them with its defaults; groups of fewer points than import's least object
/// are dropped. `extended`: with the extended convexity and the sanity criterion of its paper.
geometry::Scene locally_convex_objects(const std::filesystem::path& file, bool extended);

}  // namespace geocage::tests
