#include "tests/bench/remesh_peer.h"

#include <CGAL/Polygon_mesh_processing/remesh.h>

#include "geometry/cgal_mesh.h"

namespace geocage {

namespace pmp = CGAL::Polygon_mesh_processing;

geometry::TriangleMesh cgal_remesh(const geometry::TriangleMesh& mesh, double edge_m, int sweeps) {
  auto work = geometry::to_cgal(mesh);
  pmp::isotropic_remeshing(work.faces(), edge_m, work,
                           pmp::parameters::number_of_iterations(static_cast<unsigned>(sweeps)));
  work.collect_garbage();
  return geometry::from_cgal(work);
}

}  // namespace geocage
