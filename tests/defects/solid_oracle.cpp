#include "tests/defects/solid_oracle.h"

#include <CGAL/Polygon_mesh_processing/connected_components.h>
#include <CGAL/Polygon_mesh_processing/orientation.h>
#include <CGAL/Polygon_mesh_processing/self_intersections.h>
#include <CGAL/boost/graph/helpers.h>

#include "geometry/cgal_mesh.h"

namespace geocage::tests {

namespace pmp = CGAL::Polygon_mesh_processing;

std::string objection_of_cgal(const geometry::TriangleMesh& mesh) {
  const geometry::CgalMesh solid = geometry::to_cgal(mesh);
  if (solid.number_of_faces() != mesh.triangles.size()) return "CGAL refuses some triangles: not manifold";
  if (solid.number_of_faces() == 0) return "it is empty";
  if (!CGAL::is_valid_polygon_mesh(solid)) return "not a valid polygon mesh";
  if (!CGAL::is_closed(solid)) return "not closed";
  for (const auto v : solid.vertices())
    if (solid.is_isolated(v)) return "an isolated vertex";
  // add_face lets a pinched vertex pass: the faces around its halfedge are then not all of its faces.
  std::vector<int> corners(mesh.vertices.size(), 0);
  for (const auto& t : mesh.triangles)
    for (int v : t) ++corners[v];
  for (const auto v : solid.vertices())
    if (static_cast<int>(solid.degree(v)) != corners[v]) return "a pinched vertex";
  const auto euler = static_cast<long>(solid.number_of_vertices()) -
                     static_cast<long>(solid.number_of_edges()) + static_cast<long>(solid.number_of_faces());
  if (euler % 2 != 0 || euler > 2) return "Euler characteristic " + std::to_string(euler);
  geometry::CgalMesh work = solid;
  const auto part = work.add_property_map<geometry::CgalMesh::Face_index, std::size_t>("f:part", 0).first;
  if (pmp::connected_components(work, part) != 1) return "several components";
  if (pmp::does_self_intersect(solid)) return "it cuts itself";
  if (!pmp::is_outward_oriented(solid)) return "it faces inwards";
  return "";
}

}  // namespace geocage::tests
