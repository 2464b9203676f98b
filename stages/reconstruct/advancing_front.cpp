#include <algorithm>
#include <iterator>

#include <CGAL/Advancing_front_surface_reconstruction.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Random.h>

#include "stages/reconstruct/surfaces.h"

namespace geocage::stages {

geometry::TriangleMesh advancing_front_surface(const geometry::PointCloud& cloud, std::uint64_t seed) {
  CGAL::get_default_random() = CGAL::Random(static_cast<unsigned>(seed));  // its default is the clock
  std::vector<CGAL::Exact_predicates_inexact_constructions_kernel::Point_3> points;
  for (const auto& p : cloud.points) points.emplace_back(p.x(), p.y(), p.z());
  std::vector<std::array<std::size_t, 3>> faces;
  CGAL::advancing_front_surface_reconstruction(points.begin(), points.end(), std::back_inserter(faces));
  // Edges of equal worth are taken in the order of their addresses: mostly the same faces in another order.
  for (auto& f : faces) std::rotate(f.begin(), std::min_element(f.begin(), f.end()), f.end());
  std::sort(faces.begin(), faces.end());
  geometry::TriangleMesh mesh;
  mesh.vertices = cloud.points;
  for (const auto& f : faces)
    mesh.triangles.push_back({static_cast<int>(f[0]), static_cast<int>(f[1]), static_cast<int>(f[2])});
  return mesh;
}

}  // namespace geocage::stages
