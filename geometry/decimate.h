#pragma once
#include <cstddef>
#include <filesystem>
#include <vector>

#include "geometry/mesh.h"
#include "pipeline/run.h"

namespace geocage::geometry {

/// Triangles in single precision, as readers give them: a third of TriangleMesh's memory for huge ones.
struct RawMesh {
  std::vector<float> xyz;         ///< three a vertex
  std::vector<unsigned> corners;  ///< three a triangle
  std::size_t vertices() const { return xyz.size() / 3; }
  std::size_t triangles() const { return corners.size() / 3; }
};

/// Vertices at the very same place become one, the first of them (0 and -0 are the same); triangles that lose
/// a corner by it go. O(V + F).
void weld(RawMesh& mesh);

TriangleMesh in_metres(const RawMesh& mesh, double scale_to_m);

/// What a decimation did; lengths in the unit of the mesh.
struct Decimation {
  std::size_t before = 0, after = 0;  ///< triangles
  bool clustered = false;             ///< a grid did it: edge collapses stopped short, or lost parts
  /// One-sided: of the given corners from the result, and of samples of the result from the given triangles,
  /// `sampling` apart. Points of the given triangles can lie farther by their longest side.
  double lost = 0, added = 0, sampling = 0;
};

void save(const Decimation& done, const std::filesystem::path& file);
Decimation load_decimation(const std::filesystem::path& file);
/// As metrics `decimated_*` and a line of the log; lengths in metres.
void tell(const Decimation& done, pipeline::Run& run);

/// Collapses edges (Garland and Heckbert 1997, by meshoptimizer; vertices stay where they are) until about
/// `triangles` are left; topology stays. Where that stops short, or takes parts away (a soup of triangles
/// that share no edges), vertices of a grid's cell become one instead, if that lies nearer. About 2 s and 100
/// MB a million triangles. Preconditions: welded, valid indices, finite. Same bytes for the same mesh.
Decimation decimate(RawMesh& mesh, std::size_t triangles);

}  // namespace geocage::geometry
