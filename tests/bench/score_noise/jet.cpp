#include <set>

#include <CGAL/Monge_via_jet_fitting.h>
#include <CGAL/Simple_cartesian.h>

#include "tests/bench/score_noise/measure.h"

namespace geocage::study {

namespace {

/// The vertex itself first, then those at most two edges away.
std::vector<int> two_rings(const geometry::CompressedRows& neighbours, int v) {
  std::vector<int> near = {v};
  std::set<int> taken = {v};
  for (int ring = 0, from = 0; ring < 2; ++ring) {
    const int to = static_cast<int>(near.size());
    for (; from < to; ++from) {
      const int w = near[from];  // `near` grows below
      for (int i = neighbours.start[w]; i < neighbours.start[w + 1]; ++i)
        if (taken.insert(neighbours.items[i]).second) near.push_back(neighbours.items[i]);
    }
  }
  return near;
}

}  // namespace

std::vector<double> jet_curvature_products(const geometry::TriangleMesh& mesh) {
  using Fit = CGAL::Monge_via_jet_fitting<CGAL::Simple_cartesian<double>>;
  const auto neighbours = geometry::vertex_neighbours(mesh);
  std::vector<double> products;
  std::vector<CGAL::Simple_cartesian<double>::Point_3> points;
  for (int v = 0; v < static_cast<int>(mesh.vertices.size()); ++v) {
    points.clear();
    for (int w : two_rings(neighbours, v)) {
      const auto& p = mesh.vertices[w];
      points.emplace_back(p.x(), p.y(), p.z());
    }
    const auto form = Fit()(points.begin(), points.end(), 2, 2);
    products.push_back(form.principal_curvatures(0) * form.principal_curvatures(1));
  }
  return products;
}

}  // namespace geocage::study
