#include <CGAL/Polygon_mesh_processing/border.h>
#include <CGAL/Polygon_mesh_processing/triangulate_hole.h>

#include "geometry/cgal_mesh.h"
#include "stages/reconstruct/surfaces.h"

namespace geocage::stages {

namespace pmp = CGAL::Polygon_mesh_processing;

int fill_holes(geometry::TriangleMesh& mesh, int most_edges) {
  geometry::CgalMesh work = geometry::to_cgal(mesh);
  if (work.number_of_faces() != mesh.triangles.size()) return 0;  // not manifold: CGAL refused some
  std::vector<geometry::CgalMesh::Halfedge_index> borders;
  pmp::extract_boundary_cycles(work, std::back_inserter(borders));
  int filled = 0;
  for (const auto border : borders) {
    int edges = 0;
    for ([[maybe_unused]] const auto h : CGAL::halfedges_around_face(border, work)) ++edges;
    if (edges > most_edges) continue;
    std::vector<geometry::CgalMesh::Face_index> patch;
    pmp::triangulate_hole(work, border, std::back_inserter(patch));
    filled += !patch.empty();
  }
  mesh = geometry::from_cgal(work);
  return filled;
}

}  // namespace geocage::stages
