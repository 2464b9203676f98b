#include "stages/cloud/orient.h"

#include <algorithm>
#include <tuple>

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Random.h>
#include <CGAL/mst_orient_normals.h>
#include <CGAL/property_map.h>

namespace geocage::stages {

namespace {
using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using OrientedPoint = std::tuple<Kernel::Point_3, Kernel::Vector_3, std::size_t>;
}  // namespace

void orient_by_propagation(geometry::PointCloud& cloud, int neighbours, std::uint64_t seed) {
  CGAL::get_default_random() = CGAL::Random(static_cast<unsigned>(seed));  // its default is the clock
  std::vector<OrientedPoint> points;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const auto &p = cloud.points[i], &n = cloud.normals[i];
    points.emplace_back(Kernel::Point_3(p.x(), p.y(), p.z()), Kernel::Vector_3(n.x(), n.y(), n.z()), i);
  }
  CGAL::mst_orient_normals(points, static_cast<unsigned>(neighbours),
                           CGAL::parameters::point_map(CGAL::Nth_of_tuple_property_map<0, OrientedPoint>())
                               .normal_map(CGAL::Nth_of_tuple_property_map<1, OrientedPoint>()));
  for (const auto& [p, n, i] : points) cloud.normals[i] = {n.x(), n.y(), n.z()};
  const auto top = std::max_element(cloud.points.begin(), cloud.points.end(),
                                    [](const auto& a, const auto& b) { return a.z() < b.z(); });
  if (cloud.normals[static_cast<std::size_t>(top - cloud.points.begin())].z() < 0)
    for (auto& n : cloud.normals) n = -n;
}

}  // namespace geocage::stages
