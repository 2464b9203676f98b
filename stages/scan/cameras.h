#pragma once
#include <vector>

#include "geometry/depth_camera.h"
#include "stages/scan/scan.h"

namespace geocage::stages {

/// The cameras of a scan, all looking at `center_O`, round an object of the diagonal `diagonal_m`.
std::vector<geometry::DepthCamera> cameras_of(const ScanParams& params, const geometry::Vec3& center_O,
                                              double diagonal_m);

}  // namespace geocage::stages
