#pragma once
#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "geometry/pose.h"

namespace geocage::geometry {

/// Triangles counter-clockwise from outside; metres, object frame O.
struct TriangleMesh {
  std::vector<Vec3> vertices;
  std::vector<std::array<int, 3>> triangles;
  /// Empty (all of it was observed), or for each vertex how far the surface there was measured and not
  /// guessed: 1 at a measured point, 0 far from all of them.
  std::vector<double> observed = {};
};

/// Compressed rows: the items of vertex v are `items[start[v]] .. items[start[v + 1] - 1]`.
struct CompressedRows {
  std::vector<int> start, items;
  int size(int row) const { return start[row + 1] - start[row]; }
};

/// Neighbours of each vertex, ascending. O(F).
CompressedRows vertex_neighbours(const TriangleMesh& mesh);
/// Triangles around each vertex, ascending. O(F).
CompressedRows vertex_triangles(const TriangleMesh& mesh);

/// What is true of a mesh; ids name the first offenders.
struct MeshReport {
  int vertices = 0, edges = 0, triangles = 0, components = 0;
  int euler = 0;  ///< V - E + F over used vertices
  int boundary_edges = 0, non_manifold_edges = 0, non_manifold_vertices = 0;
  int inconsistent_edges = 0;  ///< edges that both triangles run through in the same direction
  int degenerate_triangles = 0, isolated_vertices = 0, non_finite_vertices = 0, invalid_indices = 0;
  int first_bad_vertex = 0, first_bad_triangle = 0;  ///< valid only where the counts above are not zero
  std::vector<int> offenders;         ///< up to eight triangles with the flaw that `flaw` tells
  double area_m2 = 0, volume_m3 = 0;  ///< volume is signed, positive when outward
  double mean_edge_m = 0, edge_cv = 0, min_angle_rad = 0;
  Vec3 box_min = Vec3::Zero(), box_max = Vec3::Zero();

  double diagonal_m() const { return (box_max - box_min).norm(); }
  bool sound() const;  ///< finite, valid indices, no degenerate triangle
  bool closed_manifold()
      const;  ///< sound, and every edge in two triangles, every vertex in one fan, oriented alike
};

/// Never throws: bad indices and NaN are counted. O(F log F).
MeshReport check_mesh(const TriangleMesh& mesh);
/// The first thing that keeps `report` from being a closed manifold, as a sentence with the element; empty if
/// none.
std::string flaw(const MeshReport& report);

double mean_edge_m(const TriangleMesh& mesh);
/// Area-weighted unit normals.
std::vector<Vec3> vertex_normals(const TriangleMesh& mesh);
/// Third of the area of the triangles around each vertex.
std::vector<double> vertex_areas_m2(const TriangleMesh& mesh);
/// Turns all triangles round when the signed volume is negative; true if it did.
bool orient_outward(TriangleMesh& mesh);

/// Of the solid inside a closed mesh, density 1 kg/m3.
struct MassProperties {
  double volume_m3 = 0;
  Vec3 center = Vec3::Zero();
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();  ///< about `center`, axes of O, per unit density [m5]
};
/// Volume integrals by signed tetrahedra (Mirtich 1996; exact for polyhedra). Precondition: closed, outward.
MassProperties mass_properties(const TriangleMesh& mesh);

/// A named value per vertex, for pictures and PLY files.
struct VertexField {
  std::string name;
  std::vector<double> values;
};

/// Binary little-endian PLY: x y z as double and each field as double (float64 reads back the same bytes).
void write_ply(const std::filesystem::path& file, const TriangleMesh& mesh,
               const std::vector<VertexField>& fields = {});
/// Reads what write_ply wrote: the store's own files only, foreign meshes go through read_mesh
/// (mesh_files.h).
TriangleMesh read_own_ply(const std::filesystem::path& file, std::vector<VertexField>* fields = nullptr);

std::string_view artefact_kind(
    const TriangleMesh*);  ///< "mesh": mesh.ply, with the column `observed` unless that is empty
void save_artefact(const TriangleMesh& mesh, const std::filesystem::path& dir);
void load_artefact(TriangleMesh& mesh, const std::filesystem::path& dir);

}  // namespace geocage::geometry
