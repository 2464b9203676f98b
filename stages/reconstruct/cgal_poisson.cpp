#include <CGAL/IO/facets_in_complex_2_to_triangle_mesh.h>
#include <CGAL/Implicit_surface_3.h>
#include <CGAL/Poisson_reconstruction_function.h>
#include <CGAL/Random.h>
#include <CGAL/Surface_mesh_complex_2_in_triangulation_3.h>
#include <CGAL/Surface_mesh_default_criteria_3.h>
#include <CGAL/Surface_mesh_default_triangulation_3.h>
#include <CGAL/make_surface_mesh.h>
#include <CGAL/property_map.h>

#include "geometry/cgal_mesh.h"
#include "stages/reconstruct/surfaces.h"

namespace geocage::stages {

namespace {

using Kernel = geometry::CgalKernel;

/// A cell or vertex that knows when it was made: CGAL's sets of handles follow that, not addresses, which
/// depend on what the program did before.
template <class Base>
class Stamped : public Base {
 public:
  using Base::Base;
  template <class Tds>
  struct Rebind_TDS {  // NOLINT(readability-identifier-naming): CGAL's names
    using Other = Stamped<typename Base::template Rebind_TDS<Tds>::Other>;
  };
  using Has_timestamp = CGAL::Tag_true;  // NOLINT(readability-identifier-naming)
  std::size_t time_stamp() const { return stamp_; }
  void set_time_stamp(std::size_t stamp) { stamp_ = stamp; }

 private:
  std::size_t stamp_ = static_cast<std::size_t>(-1);
};

using Traits = CGAL::Robust_circumcenter_traits_3<Kernel>;
using Vertex = Stamped<CGAL::Surface_mesh_vertex_base_3<Traits>>;
using Cell = Stamped<CGAL::Delaunay_triangulation_cell_base_with_circumcenter_3<
    Traits, CGAL::Surface_mesh_cell_base_3<Traits>>>;
using Triangulation =
    CGAL::Delaunay_triangulation_3<Traits, CGAL::Triangulation_data_structure_3<Vertex, Cell>>;

}  // namespace

geometry::TriangleMesh cgal_poisson_surface(const geometry::PointCloud& cloud, double spacing_m,
                                            std::uint64_t seed) {
  using Oriented = std::pair<Kernel::Point_3, Kernel::Vector_3>;
  constexpr double least_deg = 20, radius = 15, distance = 0.25;           // of facets; in spacings
  CGAL::get_default_random() = CGAL::Random(static_cast<unsigned>(seed));  // its default is the clock
  std::vector<Oriented> points;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const auto &p = cloud.points[i], &n = cloud.normals[i];
    points.emplace_back(Kernel::Point_3(p.x(), p.y(), p.z()), Kernel::Vector_3(n.x(), n.y(), n.z()));
  }
  using Function = CGAL::Poisson_reconstruction_function<Kernel>;
  Function function(points.begin(), points.end(), CGAL::First_of_pair_property_map<Oriented>(),
                    CGAL::Second_of_pair_property_map<Oriented>());
  if (!function.compute_implicit_function()) return {};
  // As CGAL::poisson_surface_reconstruction_delaunay does, with a triangulation whose handles have an order.
  const double reach_m = 5 * std::sqrt(function.bounding_sphere().squared_radius());
  const CGAL::Implicit_surface_3<Kernel, Function> surface(
      function, Kernel::Sphere_3(function.get_inner_point(), reach_m * reach_m),
      distance * spacing_m / 1000 / reach_m);
  Triangulation triangulation;
  CGAL::Surface_mesh_complex_2_in_triangulation_3<Triangulation> complex(triangulation);
  CGAL::make_surface_mesh(complex, surface,
                          CGAL::Surface_mesh_default_criteria_3<Triangulation>(least_deg, radius * spacing_m,
                                                                               distance * spacing_m),
                          CGAL::Manifold_with_boundary_tag());
  geometry::CgalMesh mesh;
  CGAL::facets_in_complex_2_to_triangle_mesh(complex, mesh);
  return geometry::from_cgal(mesh);
}

}  // namespace geocage::stages
