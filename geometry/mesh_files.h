#pragma once
#include <filesystem>
#include <optional>
#include <string>

#include "geometry/decimate.h"
#include "geometry/file_guards.h"
#include "geometry/mesh.h"

namespace geocage::geometry {

/// Meshes of more than `most_faces` faces are refused, or reduced to about `decimate_to`.
struct FaceGuard {
  std::uint64_t most_faces = geometry::most_faces;
  std::uint64_t decimate_to = 0;  ///< 0 refuses
};

/// A mesh, and what its decimation did, in metres, where it was too large.
struct MeshOfFile {
  TriangleMesh mesh;
  std::optional<Decimation> decimated;
};

/// Reads a foreign mesh with assimp: triangulated, identical vertices welded, all parts in one, scaled by
/// `scale_to_m`. assimp may crash or hang on broken files: call it inside a worker (pipeline/worker.h).
/// Errors (UserError, Fault::input): missing, not a regular file, empty, larger than the guard, declared
/// counts that the file can't hold, unreadable, no faces, NaN vertices (first index named), indices out of
/// range; more faces than the guard takes.
MeshOfFile read_mesh(const std::filesystem::path& file, double scale_to_m, const FaceGuard& guard);
/// The same, where meshes of more than ten million faces are refused.
TriangleMesh read_mesh(const std::filesystem::path& file, double scale_to_m = 1.0);

/// True for the ending of a format that assimp reads: ".stl", ".obj", ...
bool is_mesh_ending(const std::string& ending);

/// Refuses a bounding-box diagonal outside [0.5 cm, 5 m], naming the factors (0.001, 0.01, 0.0254) that would
/// fit.
void guard_units(const std::string& where, double diagonal);

/// Metres per unit for "m", "cm", "mm", "inch", or a number in text; UserError otherwise.
double unit_factor(const std::string& unit);

}  // namespace geocage::geometry
