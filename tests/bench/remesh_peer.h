#pragma once
#include "geometry/mesh.h"

namespace geocage {

/// CGAL's isotropic_remeshing (Botsch and Kobbelt 2004): the peer.
geometry::TriangleMesh cgal_remesh(const geometry::TriangleMesh& mesh, double edge_m, int sweeps);

}  // namespace geocage
