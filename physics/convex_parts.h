#pragma once
#include <algorithm>
#include <functional>
#include <vector>

#include "geometry/distance_field.h"

namespace geocage::physics {

/// The convex hull of a part of a solid.
struct ConvexPart {
  std::vector<geometry::Vec3> vertices_O;
  std::vector<geometry::Vec3> normals_O;  ///< outward, of its faces: n . p <= offset_m inside
  std::vector<double> offset_m;

  bool contains(const geometry::Vec3& p_O, double margin_m = 0) const;
};

struct ConvexPartsRule {
  double tolerance_m = 1.5e-3;   ///< no point of a part is farther outside the solid
  double smallest_box_m = 5e-4;  ///< boxes are not cut below this, whatever is outside
  double look_m = 2e-4;          ///< side of the smallest boxes that are looked at in a part
};

/// The rule for a tolerance: looks and boxes that suit it.
inline ConvexPartsRule parts_within(double tolerance_m) {
  const ConvexPartsRule usual;
  return {tolerance_m, std::min(usual.smallest_box_m, tolerance_m), std::min(usual.look_m, tolerance_m / 4)};
}

/// A solid as the union of convex parts: the second opinion on its shape, and what engines without fields
/// take. Boxes are halved across their longest side until the hull of what is inside (the mesh clipped to the
/// box, and the box's corners within the solid) stays within the tolerance of the solid, as its field says
/// everywhere (the field's own error is not counted); touching parts are then merged while the hull of both
/// does: only what it has beyond them is looked at. Deterministic. Precondition: a closed, outward mesh, and
/// its field; look_m < tolerance_m. O(parts * triangles + merges * looks).
std::vector<ConvexPart> convex_parts(const geometry::TriangleMesh& mesh,
                                     const geometry::SignedDistanceField& field, const ConvexPartsRule& rule);

/// The cells of `step_m` that fill a box, x fastest, and of each whether its middle is in some part.
Eigen::Array3i lattice_of(const Eigen::AlignedBox3d& box_O, double step_m);
std::vector<bool> covered_points(const Eigen::AlignedBox3d& box_O, double step_m,
                                 const std::vector<ConvexPart>& parts);

/// Euler characteristic of the closed cubes of `cell_m` whose centres are inside, V - E + F - C, and how many
/// pieces they are: of a solid bounded by a surface of characteristic chi it is chi / 2.
struct VoxelShape {
  long euler = 0;
  int pieces = 0;
  double volume_m3 = 0;
};
VoxelShape voxel_shape(const Eigen::AlignedBox3d& box_O, double cell_m,
                       const std::function<bool(const geometry::Vec3&)>& inside);
/// The same where some part contains the centre.
VoxelShape voxel_shape(const Eigen::AlignedBox3d& box_O, double cell_m, const std::vector<ConvexPart>& parts);

/// Parts with the handles, hollows and pieces of the solid, counted in voxels of `voxel_m`, and the tolerance
/// that they took.
struct FaithfulParts {
  std::vector<ConvexPart> parts;
  double tolerance_m = 0;
  bool faithful = false;  ///< false: not even at `least_m`
};
/// A crevice narrower than the tolerance may be closed to a handle or a hollow: the tolerance is halved until
/// it is not, down to `least_m`.
FaithfulParts faithful_parts(const geometry::TriangleMesh& mesh, const geometry::SignedDistanceField& field,
                             double tolerance_m, double voxel_m = 5e-4, double least_m = 1e-4);

}  // namespace geocage::physics
