#include "geometry/holes.h"

#include <algorithm>
#include <map>
#include <set>

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/triangulate_hole.h>
#include <CGAL/utility.h>

namespace geocage::geometry {

namespace {

using Point = CGAL::Exact_predicates_inexact_constructions_kernel::Point_3;
using Sides = std::set<std::pair<int, int>>;  ///< as the triangles run

Sides all_sides(const TriangleMesh& mesh) {
  Sides sides;
  for (const auto& t : mesh.triangles)
    for (int i = 0; i < 3; ++i) sides.insert({t[i], t[(i + 1) % 3]});
  return sides;
}

/// Border loops, running as the missing triangles would.
std::vector<std::vector<int>> border_loops(const Sides& sides) {
  std::map<int, int> next;
  for (const auto& [a, b] : sides)
    if (!sides.contains({b, a})) next[b] = a;
  std::vector<std::vector<int>> loops;
  while (!next.empty()) {
    auto& loop = loops.emplace_back();
    for (auto it = next.begin(); it != next.end(); it = next.find(loop.back())) {
      if (loop.empty()) loop.push_back(it->first);
      loop.push_back(it->second);
      next.erase(it);
    }
    loop.pop_back();  // the first vertex again
  }
  return loops;
}

std::vector<std::array<int, 3>> patch_of(const TriangleMesh& mesh, const std::vector<int>& loop) {
  std::vector<Point> points;
  for (int v : loop) points.emplace_back(mesh.vertices[v].x(), mesh.vertices[v].y(), mesh.vertices[v].z());
  std::vector<CGAL::Triple<int, int, int>> triples;
  CGAL::Polygon_mesh_processing::triangulate_hole_polyline(points, std::back_inserter(triples));
  std::vector<std::array<int, 3>> patch;
  for (const auto& t : triples) patch.push_back({loop[t.first], loop[t.second], loop[t.third]});
  return patch;
}

bool repeats_a_side(const std::vector<std::array<int, 3>>& patch, const Sides& sides) {
  for (const auto& t : patch)
    for (int i = 0; i < 3; ++i)
      if (sides.contains({t[i], t[(i + 1) % 3]})) return true;
  return false;
}

std::vector<std::array<int, 3>> fan_of(TriangleMesh& mesh, const std::vector<int>& loop) {
  Vec3 middle = Vec3::Zero();
  for (int v : loop) middle += mesh.vertices[v] / static_cast<double>(loop.size());
  const int center = static_cast<int>(mesh.vertices.size());
  mesh.vertices.push_back(middle);
  std::vector<std::array<int, 3>> fan;
  for (std::size_t i = 0; i < loop.size(); ++i) fan.push_back({loop[i], loop[(i + 1) % loop.size()], center});
  return fan;
}

}  // namespace

int fill_holes(TriangleMesh& mesh, int most_edges) {
  Sides sides = all_sides(mesh);
  int filled = 0;
  for (const auto& loop : border_loops(sides)) {
    if (loop.size() < 3 || loop.size() > static_cast<std::size_t>(most_edges)) continue;
    auto patch = patch_of(mesh, loop);
    if (patch.size() != loop.size() - 2 || repeats_a_side(patch, sides)) patch = fan_of(mesh, loop);
    for (const auto& t : patch) {
      mesh.triangles.push_back(t);
      for (int i = 0; i < 3; ++i) sides.insert({t[i], t[(i + 1) % 3]});
    }
    ++filled;
  }
  return filled;
}

}  // namespace geocage::geometry
