#include <CGAL/Random.h>
#include <CGAL/poisson_surface_reconstruction.h>
#include <CGAL/property_map.h>

#include "geometry/cgal_mesh.h"
#include "stages/reconstruct/surfaces.h"

namespace geocage::stages {

geometry::TriangleMesh cgal_poisson_surface(const geometry::PointCloud& cloud, double spacing_m,
                                            std::uint64_t seed) {
  using Kernel = geometry::CgalKernel;
  using Oriented = std::pair<Kernel::Point_3, Kernel::Vector_3>;
  CGAL::get_default_random() = CGAL::Random(static_cast<unsigned>(seed));  // its default is the clock
  std::vector<Oriented> points;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const auto &p = cloud.points[i], &n = cloud.normals[i];
    points.emplace_back(Kernel::Point_3(p.x(), p.y(), p.z()), Kernel::Vector_3(n.x(), n.y(), n.z()));
  }
  geometry::CgalMesh mesh;
  const bool found = CGAL::poisson_surface_reconstruction_delaunay(
      points.begin(), points.end(), CGAL::First_of_pair_property_map<Oriented>(),
      CGAL::Second_of_pair_property_map<Oriented>(), mesh, spacing_m, 20, 15, 0.25);
  return found ? geometry::from_cgal(mesh) : geometry::TriangleMesh();
}

}  // namespace geocage::stages
