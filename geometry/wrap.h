#pragma once
#include <cstdint>

#include "geometry/mesh.h"

namespace geocage::geometry {

/// CGAL's alpha_wrap_3 (Portaneri et al. 2022) round triangles, or round the vertices where there are none:
/// closed and manifold whatever they are, but outside them by `offset_m`; openings smaller than `alpha_m` are
/// closed. May take long and much memory for a small alpha: call it in a worker process. O((A / alpha^2)
/// log).
TriangleMesh wrapped_surface(const TriangleMesh& mesh, double alpha_m, double offset_m, std::uint64_t seed);

}  // namespace geocage::geometry
