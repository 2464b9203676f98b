#include "geometry/wrap.h"

#include <CGAL/Random.h>
#include <CGAL/alpha_wrap_3.h>

#include "geometry/cgal_mesh.h"

namespace geocage::geometry {

TriangleMesh wrapped_surface(const TriangleMesh& mesh, double alpha_m, double offset_m, std::uint64_t seed) {
  CGAL::get_default_random() = CGAL::Random(static_cast<unsigned>(seed));  // its default is the clock
  std::vector<CgalKernel::Point_3> points;
  for (const auto& p : mesh.vertices) points.emplace_back(p.x(), p.y(), p.z());
  CgalMesh wrap;
  if (mesh.triangles.empty())
    CGAL::alpha_wrap_3(points, alpha_m, offset_m, wrap);
  else
    CGAL::alpha_wrap_3(points, mesh.triangles, alpha_m, offset_m, wrap);
  return from_cgal(wrap);
}

}  // namespace geocage::geometry
