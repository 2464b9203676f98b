#pragma once
#include <filesystem>

#include "geometry/cloud.h"

namespace geocage::geometry {

/// Reads a foreign cloud (.pcd, .ply without faces, .xyz) with PCL, scaled by `scale_to_m`. Call it inside a
/// worker. Points that are NaN mean "no return" in an organised cloud; in an unorganised one they are dropped
/// and, above 20 %, the file is refused. A PCD's viewpoint becomes the one sensor origin. `dropped` counts
/// the lost points. Errors (UserError, Fault::input) as read_mesh; fewer than 4 points.
PointCloud read_cloud(const std::filesystem::path& file, double scale_to_m = 1.0, int* dropped = nullptr);

/// True for a file that holds a cloud: .pcd, .xyz, or a .ply whose header declares no faces.
bool is_cloud_file(const std::filesystem::path& file);

}  // namespace geocage::geometry
