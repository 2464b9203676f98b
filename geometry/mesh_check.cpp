#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>

#include "geometry/mesh.h"

namespace geocage::geometry {

namespace {

/// A triangle's side, seen from the edge's smaller vertex.
struct Side {
  int low, high, triangle;
  bool forward;  ///< the triangle runs from low to high
  bool operator<(const Side& other) const {
    return std::tie(low, high, triangle) < std::tie(other.low, other.high, other.triangle);
  }
  bool same_edge(const Side& other) const { return low == other.low && high == other.high; }
};

/// Union-find with path halving.
class Parts {
 public:
  explicit Parts(std::size_t count) : parent_(count) { std::iota(parent_.begin(), parent_.end(), 0); }
  int root(int i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  void join(int a, int b) { parent_[root(a)] = root(b); }

 private:
  std::vector<int> parent_;
};

std::vector<Side> sorted_sides(const TriangleMesh& mesh, const std::vector<int>& triangles) {
  std::vector<Side> sides;
  for (int f : triangles)
    for (int i = 0; i < 3; ++i) {
      const int a = mesh.triangles[f][i], b = mesh.triangles[f][(i + 1) % 3];
      sides.push_back({std::min(a, b), std::max(a, b), f, a < b});
    }
  std::sort(sides.begin(), sides.end());
  return sides;
}

/// Vertices whose triangles, joined over the edges at the vertex, fall into more than one fan.
std::vector<char> pinched_vertices(const TriangleMesh& mesh, const std::vector<Side>& sides) {
  // A corner is (triangle, one of its vertices); two corners of a vertex join when their triangles share an
  // edge there.
  Parts corners(mesh.triangles.size() * 3);
  const auto corner = [&](int triangle, int vertex) {
    const auto& t = mesh.triangles[triangle];
    return 3 * triangle + static_cast<int>(std::find(t.begin(), t.end(), vertex) - t.begin());
  };
  for (std::size_t i = 1; i < sides.size(); ++i)
    if (sides[i].same_edge(sides[i - 1]))
      for (int v : {sides[i].low, sides[i].high})
        corners.join(corner(sides[i].triangle, v), corner(sides[i - 1].triangle, v));
  std::vector<int> fan_of(mesh.vertices.size(), -1);
  std::vector<char> pinched(mesh.vertices.size(), 0);
  for (const Side& side : sides)
    for (int v : {side.low, side.high}) {
      const int fan = corners.root(corner(side.triangle, v));
      if (fan_of[v] >= 0 && fan_of[v] != fan) pinched[v] = 1;
      fan_of[v] = fan;
    }
  return pinched;
}

/// The first triangles with the flaw that `flaw` tells of edges and vertices.
std::vector<int> offending_triangles(const MeshReport& report, const std::vector<Side>& sides,
                                     const std::vector<char>& pinched) {
  constexpr std::size_t most = 8;
  std::vector<int> found;
  for (std::size_t i = 0; i < sides.size();) {
    std::size_t end = i, forward = 0;
    for (; end < sides.size() && sides[end].same_edge(sides[i]); ++end) forward += sides[end].forward;
    const std::size_t around = end - i;
    const bool bad = report.non_manifold_edges   ? around > 2
                     : report.boundary_edges     ? around == 1
                     : report.inconsistent_edges ? around == 2 && forward != 1
                                                 : pinched[sides[i].low] || pinched[sides[i].high];
    for (; i < end; ++i)
      if (bad) found.push_back(sides[i].triangle);
  }
  std::sort(found.begin(), found.end());
  found.erase(std::unique(found.begin(), found.end()), found.end());
  if (found.size() > most) found.resize(most);
  return found;
}

void count_edges(const std::vector<Side>& sides, const TriangleMesh& mesh, MeshReport& report) {
  double sum = 0, squares = 0;
  for (std::size_t i = 0; i < sides.size();) {
    std::size_t end = i, forward = 0;
    for (; end < sides.size() && sides[end].same_edge(sides[i]); ++end) forward += sides[end].forward;
    const std::size_t around = end - i;
    report.boundary_edges += around == 1;
    report.non_manifold_edges += around > 2;
    report.inconsistent_edges += around == 2 && forward != 1;
    const double length = (mesh.vertices[sides[i].low] - mesh.vertices[sides[i].high]).norm();
    sum += length;
    squares += length * length;
    ++report.edges;
    i = end;
  }
  if (report.edges == 0) return;
  report.mean_edge_m = sum / report.edges;
  const double variance = squares / report.edges - report.mean_edge_m * report.mean_edge_m;
  report.edge_cv = std::sqrt(std::max(0.0, variance)) / report.mean_edge_m;
}

void measure_triangle(const TriangleMesh& mesh, const std::array<int, 3>& t, MeshReport& report) {
  const Vec3 &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
  report.area_m2 += (b - a).cross(c - a).norm() / 2;
  report.volume_m3 += a.dot(b.cross(c)) / 6;
  for (int i = 0; i < 3; ++i) {
    const Vec3 u = mesh.vertices[t[(i + 1) % 3]] - mesh.vertices[t[i]];
    const Vec3 v = mesh.vertices[t[(i + 2) % 3]] - mesh.vertices[t[i]];
    report.min_angle_rad = std::min(report.min_angle_rad, std::atan2(u.cross(v).norm(), u.dot(v)));
  }
}

}  // namespace

bool MeshReport::sound() const {
  return triangles > 0 && non_finite_vertices == 0 && invalid_indices == 0 && degenerate_triangles == 0;
}

bool MeshReport::closed_manifold() const {
  return sound() && boundary_edges == 0 && non_manifold_edges == 0 && non_manifold_vertices == 0 &&
         inconsistent_edges == 0;
}

MeshReport check_mesh(const TriangleMesh& mesh) {
  MeshReport report;
  const int count = static_cast<int>(mesh.vertices.size());
  report.vertices = count;
  report.triangles = static_cast<int>(mesh.triangles.size());
  for (int v = count - 1; v >= 0; --v)
    if (!mesh.vertices[v].allFinite()) {
      ++report.non_finite_vertices;
      report.first_bad_vertex = v;
    }

  std::vector<int> good;  // triangles that can be measured
  for (int f = report.triangles - 1; f >= 0; --f) {
    const auto& t = mesh.triangles[f];
    const bool inside = std::all_of(t.begin(), t.end(), [&](int v) { return v >= 0 && v < count; });
    const bool degenerate = inside && (t[0] == t[1] || t[1] == t[2] || t[2] == t[0] ||
                                       (mesh.vertices[t[1]] - mesh.vertices[t[0]])
                                               .cross(mesh.vertices[t[2]] - mesh.vertices[t[0]])
                                               .norm() == 0);
    report.invalid_indices += !inside;
    report.degenerate_triangles += degenerate;
    if (!inside || degenerate)
      report.offenders.push_back(f);
    else
      good.push_back(f);
  }
  std::reverse(report.offenders.begin(), report.offenders.end());
  if (report.offenders.size() > 8) report.offenders.resize(8);
  if (!report.offenders.empty()) report.first_bad_triangle = report.offenders.front();
  if (report.non_finite_vertices > 0) return report;
  std::reverse(good.begin(), good.end());

  report.min_angle_rad = good.empty() ? 0 : M_PI;
  for (int f : good) measure_triangle(mesh, mesh.triangles[f], report);
  const auto sides = sorted_sides(mesh, good);
  count_edges(sides, mesh, report);
  const auto pinched = pinched_vertices(mesh, sides);
  report.non_manifold_vertices = static_cast<int>(std::count(pinched.begin(), pinched.end(), 1));
  if (report.offenders.empty()) report.offenders = offending_triangles(report, sides, pinched);

  Parts parts(mesh.vertices.size());
  std::vector<char> used(mesh.vertices.size(), 0);
  for (const Side& side : sides) {
    parts.join(side.low, side.high);
    used[side.low] = used[side.high] = 1;
  }
  bool first = true;
  int used_count = 0;
  for (int v = 0; v < count; ++v) {
    if (!used[v]) continue;
    ++used_count;
    report.components += parts.root(v) == v;
    const Vec3& p = mesh.vertices[v];
    report.box_min = first ? p : report.box_min.cwiseMin(p);
    report.box_max = first ? p : report.box_max.cwiseMax(p);
    first = false;
  }
  report.isolated_vertices = count - used_count;
  report.euler = used_count - report.edges + static_cast<int>(good.size());
  return report;
}

std::string flaw(const MeshReport& r) {
  const auto some = [](int n, const char* what) { return std::to_string(n) + " " + what; };
  if (r.triangles == 0) return "it has no triangles";
  if (r.non_finite_vertices) return "vertex " + std::to_string(r.first_bad_vertex) + " is not finite";
  if (r.invalid_indices)
    return "triangle " + std::to_string(r.first_bad_triangle) + " names a vertex that is not there";
  if (r.degenerate_triangles) return "triangle " + std::to_string(r.first_bad_triangle) + " has no area";
  if (r.non_manifold_edges) return some(r.non_manifold_edges, "edges have more than two triangles");
  if (r.boundary_edges) return some(r.boundary_edges, "edges have one triangle only: it is not closed");
  if (r.inconsistent_edges)
    return some(r.inconsistent_edges, "edges part triangles that are oriented differently");
  if (r.non_manifold_vertices)
    return some(r.non_manifold_vertices, "vertices hold more than one fan of triangles");
  return "";
}

}  // namespace geocage::geometry
