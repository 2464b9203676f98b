#pragma once
#include "geometry/mesh.h"

namespace geocage::topology {

using geometry::Vec3;

/// Signed solid angle [sr] of triangle abc seen from x, in (-2 pi, 2 pi): the flux through it of a charge at
/// x (4 pi in all), positive when abc runs counter-clockwise seen from the side away from x, that is, when
/// its normal points away from x. 0 where x is a corner. Van Oosterom and Strackee 1983.
double triangle_flux_sr(const Vec3& x, const Vec3& a, const Vec3& b, const Vec3& c);

/// Flux through all triangles of a surface: 4 pi from inside a closed outward mesh, 0 from outside.
double surface_flux_sr(const Vec3& x, const geometry::TriangleMesh& surface);

/// Flux through `surface` of charges spread evenly over `object`, as a share of all that they send out: the
/// charge heuristic. `|share|` is 1 for a closed surface around the object and 0 for one that is far away.
/// Quadrature of 4 points a triangle of the object. O(F_object F_surface).
double flux_share(const geometry::TriangleMesh& object, const geometry::TriangleMesh& surface);

}  // namespace geocage::topology
