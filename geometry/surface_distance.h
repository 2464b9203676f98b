#pragma once
#include <algorithm>
#include <cmath>

#include "geometry/surface.h"

namespace geocage::geometry {

/// Distances of the points of one surface to another one.
struct OneSidedDistance {
  double mean_m = 0, rms_m = 0;  ///< over the area, by the midpoint rule
  double max_m = 0;              ///< over the samples; the true maximum is at most 2/3 of the spacing more
  std::size_t samples = 0;
};

/// Each triangle of `from` is cut into k^2 alike ones whose longest side is at most `spacing_m`; their
/// centroids and the vertices are the samples. Precondition: triangles on both sides. O(samples log F), on
/// all threads, the same bytes for any number of them.
OneSidedDistance distance_from_to(const TriangleMesh& from, const Surface& to, double spacing_m);

struct SurfaceDistance {
  OneSidedDistance there, back;  ///< from a to b, from b to a
  double hausdorff_m() const { return std::max(there.max_m, back.max_m); }
  double mean_m() const { return (there.mean_m + back.mean_m) / 2; }
  double rms_m() const { return std::sqrt((there.rms_m * there.rms_m + back.rms_m * back.rms_m) / 2); }
};
/// Both ways (Cignoni, Rocchini and Scopigno 1998, Metro: measuring error on simplified surfaces).
SurfaceDistance surface_distance(const TriangleMesh& a, const TriangleMesh& b, double spacing_m);

}  // namespace geocage::geometry
