#pragma once
#include <filesystem>

#include "geometry/cloud.h"

namespace geocage::geometry {

/// Reads a foreign cloud, scaled by `scale_to_m`: .pcd and .ply without faces with PCL (any number type, a
/// field `label` is kept), .xyz .txt .asc .csv as text: three numbers a line, parted by blanks, commas,
/// semicolons or tabs; more columns and lines that begin with # or // are passed over, and so is a first line
/// of names. Call it inside a worker. Points that are NaN mean "no return" in an organised cloud; in an
/// unorganised one they are dropped and, above 20 %, the file is refused. A PCD's viewpoint becomes the one
/// sensor origin, unless it lies among the points: then nobody has set it. `dropped` counts the lost points.
/// Errors (UserError, Fault::input) as read_mesh; counts that the file can't hold; decimal commas; fewer than
/// 4 points.
PointCloud read_cloud(const std::filesystem::path& file, double scale_to_m = 1.0, int* dropped = nullptr);

/// True for an ending that clouds may have; .ply may hold a mesh as well.
bool is_cloud_ending(const std::string& ending);

/// True for a file that holds a cloud: .pcd, .xyz, .asc, .txt, .csv, or a .ply whose header declares no
/// faces.
bool is_cloud_file(const std::filesystem::path& file);

}  // namespace geocage::geometry
