#pragma once
#include <filesystem>
#include <vector>

#include "geometry/pose.h"

namespace geocage::geometry {

/// Points of a text file (cloud_files.h says what it may look like); NaN and infinite ones too. UserError
/// (input) with the line's number.
std::vector<Vec3> read_text_points(const std::filesystem::path& file);

}  // namespace geocage::geometry
