#pragma once
#include <cstdint>
#include <filesystem>
#include <string_view>
#include <vector>

#include "geometry/mesh.h"

namespace geocage::geometry {

/// Signed distance to a closed surface, negative inside: a dense grid of exact distances at its nodes, and
/// finer blocks inside coarse cells that the surface may cross, so that thin walls keep both their sides, or
/// that are too coarse for the distance in them. Trilinear between nodes. Outside the grid: distance to the
/// grid's box plus the value at the nearest point of the box, an over-estimate by at most that of the box
/// distance.
struct SignedDistanceField {
  Vec3 origin = Vec3::Zero();  ///< node (0,0,0), in O
  double cell_m = 0;           ///< coarse cell
  std::array<int, 3> nodes = {0, 0, 0};
  std::vector<float> coarse;  ///< x fastest
  /// Per coarse cell (x fastest): 0, or 16 begin + n where its block of (n+1)^3 nodes, n fine cells a side,
  /// begins at fine[begin].
  std::vector<std::uint32_t> block;
  std::vector<float> fine;  ///< the blocks' nodes, x fastest in each
  /// Told from the above by mark(), never stored; empty until then. Of each coarse cell one byte: 1 for a
  /// block, plus 2 k where no value in it is below k / 4 coarse cells (k = 0: nothing is said). Cells near
  /// each other lie together (marks_along.h), so that a way through the field stays in a processor's near
  /// memory.
  std::vector<std::uint8_t> marks;
  void mark();

  /// The cell between whose nodes the value at p is interpolated (at the nearest point of the box when p is
  /// outside), and where in it p lies, each coordinate in [0, 1].
  struct Cell {
    double side_m;
    Vec3 fraction;
    double value;   ///< there: that of the nearest point of the box when p is outside
    double away_m;  ///< of p from the box; 0 inside
  };
  Cell cell_at(const Vec3& p_O) const;
  /// Side of the smallest cell.
  double finest_cell_m() const;

  double value(const Vec3& p_O) const;
  /// From the marks alone, for the points a + i / last * ab, i = 0 ... last < 128: what the value is not
  /// below, or 0 where that is not known. Minus infinity without marks.
  void bounds_along(const Vec3& a_O, const Vec3& ab_O, int last, std::array<float, 128>& bound_m) const;
  /// Value, and its gradient (of the interpolant, not normalised) in `gradient`.
  double value(const Vec3& p_O, Vec3& gradient) const;
};

struct FieldGrid {
  int cells = 64;       ///< along the longest side of the padded box
  double pad_m = 0.03;  ///< free border around the surface's box
  int refine = 3;       ///< fine cells along a coarse cell that the surface may cross, at least
  /// Cells with points outside and nearer to the surface than `near_m` are parted until interpolation errs
  /// there by about this (at most 15 parts along a coarse cell); 0: no cell is parted for it.
  double error_m = 2.5e-4;
  double near_m = 0.005;
  double inside_error_m = 4e-4;  ///< the same for points inside
};

/// Exact node distances (nearest_of_eight.h, in double, kept as float), sign by flooding
/// between nodes that no surface can part (|d_a| + |d_b| > |ab|) and a majority of first-hit facings of 5
/// fixed rays per flooded part. How far a cell errs is told from the distances and their gradients at its
/// corners, and in a coarse one from what its middle and the middles of its faces are off. Precondition:
/// closed, outward mesh; 1 <= refine <= 15. Same bytes for any thread count. O(N log F) for N nodes. Errors:
/// UserError (geometry) when the blocks had more than 2^28 nodes.
SignedDistanceField build_distance_field(const TriangleMesh& mesh, const FieldGrid& grid);

/// The point of triangle abc nearest to p; a triangle without area counts as its edges.
Vec3 closest_point_on_triangle(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c);
/// Exact unsigned distance of p to the mesh by brute force, O(F): the oracle of tests.
double brute_force_distance_m(const TriangleMesh& mesh, const Vec3& p);
/// Generalised winding number of the closed mesh around p (Jacobson et al. 2013, eq. 5), O(F): 1 inside, 0
/// outside.
double winding_number_of_mesh(const TriangleMesh& mesh, const Vec3& p);

std::string_view artefact_kind(
    const SignedDistanceField*);  ///< "field": coarse.nrrd + blocks.bin + field.json
void save_artefact(const SignedDistanceField& field, const std::filesystem::path& dir);
void load_artefact(SignedDistanceField& field, const std::filesystem::path& dir);

}  // namespace geocage::geometry
