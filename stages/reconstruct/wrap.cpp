#include <CGAL/Random.h>
#include <CGAL/alpha_wrap_3.h>

#include "geometry/cgal_mesh.h"
#include "stages/reconstruct/surfaces.h"

namespace geocage::stages {

geometry::TriangleMesh wrapped_surface(const geometry::PointCloud& cloud, double alpha_m, double offset_m,
                                       std::uint64_t seed) {
  CGAL::get_default_random() = CGAL::Random(static_cast<unsigned>(seed));  // its default is the clock
  std::vector<geometry::CgalKernel::Point_3> points;
  for (const auto& p : cloud.points) points.emplace_back(p.x(), p.y(), p.z());
  geometry::CgalMesh wrap;
  CGAL::alpha_wrap_3(points, alpha_m, offset_m, wrap);
  return geometry::from_cgal(wrap);
}

}  // namespace geocage::stages
