#pragma once
#include <filesystem>
#include <vector>

#include "geometry/pose.h"

namespace geocage::topology {

using geometry::Vec3;
using Polyline = std::vector<Vec3>;

/// One "x,y,z" a line, metres. UserError (input) naming file and line: not three finite numbers, fewer than
/// two points.
Polyline read_polyline(const std::filesystem::path& file);

}  // namespace geocage::topology
