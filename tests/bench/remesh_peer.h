#pragma once
#include "geometry/mesh.h"

namespace geocage {

/// CGAL's isotropic_remeshing (Botsch and Kobbelt 2004).
geometry::TriangleMesh cgal_remesh(const geometry::TriangleMesh& mesh, double edge_m, int sweeps);
/// Pairs of triangles that cut each other, by CGAL's exact predicates.
std::size_t self_intersections(const geometry::TriangleMesh& mesh);

}  // namespace geocage
