#pragma once
#include <filesystem>
#include <string_view>
#include <vector>

#include "geometry/mesh.h"

namespace geocage::geometry {

/// Signed distance to a closed surface, negative inside: a dense grid of exact distances at its nodes, and
/// around the surface a finer block inside each coarse cell, so that thin walls keep both their sides.
/// Trilinear between nodes. Outside the grid: distance to the grid's box plus the value at the nearest point
/// of the box, an over-estimate by at most that of the box distance.
struct SignedDistanceField {
  Vec3 origin = Vec3::Zero();  ///< node (0,0,0), in O
  double cell_m = 0;           ///< coarse cell
  std::array<int, 3> nodes = {0, 0, 0};
  std::vector<float> coarse;  ///< x fastest
  int refine = 1;             ///< fine cells along a coarse cell
  std::vector<int> block;     ///< per coarse cell: index of its block, or -1 (x fastest)
  std::vector<float> fine;    ///< (refine+1)^3 nodes a block, x fastest

  double value(const Vec3& p_O) const;
  /// Value, and its gradient (of the interpolant, not normalised) in `gradient`.
  double value(const Vec3& p_O, Vec3& gradient) const;
};

struct FieldGrid {
  int cells = 64;       ///< along the longest side of the padded box
  double pad_m = 0.03;  ///< free border around the surface's box
  int refine = 3;
};

/// Exact node distances by Embree closest-point queries (triangle distance in double), sign by flooding
/// between nodes that no surface can part (|d_a| + |d_b| > |ab|) and a majority of first-hit facings of 5
/// fixed rays per flooded part. Precondition: closed, outward mesh. Same bytes for any thread count. O(N log
/// F) for N nodes.
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
