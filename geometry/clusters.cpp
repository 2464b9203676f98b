#include "geometry/clusters.h"

#include <map>
#include <numeric>

#include <CGAL/Delaunay_triangulation_3.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Spatial_sort_traits_adapter_3.h>
#include <CGAL/Triangulation_vertex_base_with_info_3.h>
#include <CGAL/property_map.h>
#include <CGAL/spatial_sort.h>
#include <boost/pending/disjoint_sets.hpp>

namespace geocage::geometry {

std::vector<std::vector<int>> clusters(const std::vector<Vec3>& points, double gap) {
  using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
  using Vertex = CGAL::Triangulation_vertex_base_with_info_3<int, Kernel>;  // the first point there
  using Structure =
      CGAL::Triangulation_data_structure_3<Vertex, CGAL::Delaunay_triangulation_cell_base_3<Kernel>>;
  using Delaunay = CGAL::Delaunay_triangulation_3<Kernel, Structure>;

  std::vector<Kernel::Point_3> at;
  for (const Vec3& p : points) at.emplace_back(p.x(), p.y(), p.z());
  std::vector<std::size_t> order(points.size());
  std::iota(order.begin(), order.end(), 0);
  const auto places = CGAL::make_property_map(at);
  CGAL::spatial_sort(order.begin(), order.end(),
                     CGAL::Spatial_sort_traits_adapter_3<Kernel, decltype(places)>(places));

  boost::disjoint_sets_with_storage<> sets(points.size());
  Delaunay mesh;
  Delaunay::Cell_handle near;
  for (const std::size_t i : order) {
    const std::size_t before = mesh.number_of_vertices();
    const auto vertex = mesh.insert(at[i], near);
    if (mesh.number_of_vertices() > before) vertex->info() = static_cast<int>(i);
    sets.union_set(i, static_cast<std::size_t>(vertex->info()));
    near = vertex->cell();
  }
  for (auto edge = mesh.finite_edges_begin(); edge != mesh.finite_edges_end(); ++edge) {
    const auto a = static_cast<std::size_t>(edge->first->vertex(edge->second)->info());
    const auto b = static_cast<std::size_t>(edge->first->vertex(edge->third)->info());
    if ((points[a] - points[b]).norm() <= gap) sets.union_set(a, b);
  }
  std::map<std::size_t, std::size_t> number;  // of a set
  std::vector<std::vector<int>> found;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto [known, first] = number.try_emplace(sets.find_set(i), found.size());
    if (first) found.emplace_back();
    found[known->second].push_back(static_cast<int>(i));
  }
  return found;
}

}  // namespace geocage::geometry
