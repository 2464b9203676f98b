#pragma once
#include <filesystem>
#include <string>

#include "geometry/mesh.h"

namespace geocage::geometry {

/// Reads a foreign mesh with assimp: triangulated, identical vertices welded, all parts in one, scaled by
/// `scale_to_m`. assimp may crash or hang on broken files: call it inside a worker (pipeline/worker.h).
/// Errors (UserError, Fault::input): missing, not a regular file, empty, larger than the guard, declared
/// counts that the file can't hold, unreadable, no faces, NaN vertices (first index named), indices out of
/// range.
TriangleMesh read_mesh(const std::filesystem::path& file, double scale_to_m = 1.0);

/// True for the ending of a format that assimp reads: ".stl", ".obj", ...
bool is_mesh_ending(const std::string& ending);

/// Refuses a bounding-box diagonal outside [0.5 cm, 5 m], naming the factors (0.001, 0.01, 0.0254) that would
/// fit.
void guard_units(const std::string& where, double diagonal);

/// Metres per unit for "m", "cm", "mm", "inch", or a number in text; UserError otherwise.
double unit_factor(const std::string& unit);

}  // namespace geocage::geometry
