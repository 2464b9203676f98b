#pragma once
// The bridge to CGAL, for source files that call it. Headers never include this one: CGAL costs 10 s a file.
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Surface_mesh.h>

#include "geometry/mesh.h"

namespace geocage::geometry {

using CgalKernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using CgalMesh = CGAL::Surface_mesh<CgalKernel::Point_3>;

/// Precondition: edges are manifold. Vertices and faces keep their order.
inline CgalMesh to_cgal(const TriangleMesh& mesh) {
  CgalMesh out;
  for (const Vec3& p : mesh.vertices) out.add_vertex({p.x(), p.y(), p.z()});
  using V = CgalMesh::Vertex_index;
  for (const auto& t : mesh.triangles)
    out.add_face(V(static_cast<unsigned>(t[0])), V(static_cast<unsigned>(t[1])),
                 V(static_cast<unsigned>(t[2])));
  return out;
}

/// Removed elements are left out; the order is kept.
inline TriangleMesh from_cgal(const CgalMesh& mesh) {
  TriangleMesh out;
  std::vector<int> index(mesh.num_vertices() + mesh.number_of_removed_vertices());
  for (const auto v : mesh.vertices()) {
    index[v] = static_cast<int>(out.vertices.size());
    const auto& p = mesh.point(v);
    out.vertices.emplace_back(p.x(), p.y(), p.z());
  }
  for (const auto f : mesh.faces()) {
    std::array<int, 3> t;
    int i = 0;
    for (const auto v : mesh.vertices_around_face(mesh.halfedge(f))) t[i++] = index[v];
    out.triangles.push_back(t);
  }
  return out;
}

}  // namespace geocage::geometry
