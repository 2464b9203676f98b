#include "stages/remesh/isotropic.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "stages/remesh/remesher.h"

namespace geocage::stages {

using geometry::TriangleMesh;
using geometry::Vec3;

namespace {

/// The place of a point on a curve through the cells of its box (Morton 1966): near points, near places.
std::uint64_t place(const Vec3& p, const Vec3& low, double size) {
  std::uint64_t code = 0;
  constexpr int bits = 16;
  for (int i = 0; i < 3; ++i) {
    const auto cell = static_cast<std::uint64_t>((p[i] - low[i]) / size * ((1 << bits) - 1));
    for (int b = 0; b < bits; ++b) code |= (cell >> b & 1) << (3 * b + i);
  }
  return code;
}

/// The same mesh in an order that only its points decide, near ones near to each other.
TriangleMesh canonical(const TriangleMesh& mesh, const Vec3& low, double size) {
  std::vector<int> order(mesh.vertices.size()), rank(mesh.vertices.size());
  std::vector<std::uint64_t> places;
  for (const Vec3& p : mesh.vertices) places.push_back(place(p, low, size));
  std::iota(order.begin(), order.end(), 0);
  const auto key = [&](int v) {
    const Vec3& p = mesh.vertices[v];
    return std::make_tuple(places[v], p.x(), p.y(), p.z());
  };
  std::sort(order.begin(), order.end(), [&](int a, int b) { return key(a) < key(b); });
  TriangleMesh out;
  for (std::size_t i = 0; i < order.size(); ++i) {
    rank[order[i]] = static_cast<int>(i);
    out.vertices.push_back(mesh.vertices[order[i]]);
  }
  for (auto t : mesh.triangles) {
    for (int& v : t) v = rank[v];
    std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
    out.triangles.push_back(t);
  }
  std::sort(out.triangles.begin(), out.triangles.end());
  return out;
}

}  // namespace

TriangleMesh isotropic(const TriangleMesh& mesh, int vertices, int sweeps,
                       const std::function<void(std::size_t, std::size_t)>& progress) {
  constexpr int finishing = 4, lifts = 5;
  constexpr double lifted_rad = 33 * M_PI / 180, slim_rad = 28 * M_PI / 180;
  const auto report = check_mesh(mesh);
  const double edge_m = std::sqrt(report.area_m2 / vertices / (std::sqrt(3.0) / 2));
  Remesher work(canonical(mesh, report.box_min, report.diagonal_m()), edge_m);
  std::size_t done = 0;
  const auto tell = [&] {
    if (progress) progress(++done, std::size_t(sweeps) + finishing + lifts);
  };

  double h = edge_m;
  for (int s = 0; s < sweeps; ++s) {
    work.split_longer(4.0 / 3 * h);
    work.collapse_shorter(4.0 / 5 * h);
    work.flip_for_valence();
    work.relax(2);
    h *= std::sqrt(std::clamp(static_cast<double>(work.vertices()) / vertices, 0.5, 2.0));
    tell();
  }
  for (int s = 0; s < finishing; ++s) {
    work.remove_low_valences();
    work.meet_count(vertices);
    work.flip_for_valence();
    work.relax(4);
    work.flip_for_angle();
    tell();
  }
  work.flip_for_valence();
  work.relax(10);
  for (int s = 0; s < lifts; ++s) {
    work.flip_for_angle();
    work.lift_angles(lifted_rad);
    if (s + 1 < lifts) work.remove_slim(slim_rad);
    tell();
  }
  work.part_cuts(20);
  return work.mesh();
}

}  // namespace geocage::stages
