#include "topology/loops.h"

#include <algorithm>
#include <array>
#include <limits>

#include <omp.h>

#include "topology/linking.h"
#include "topology/loop_search.h"
#include "topology/surface_string.h"

namespace geocage::topology {

using geometry::TriangleMesh;

namespace {

/// How far a loop is lifted off the surface to see what it is linked with, in mean edges: far enough for the
/// arctangents of nearly touching segments, near enough for any wall.
constexpr double lift_edges = 1e-3;
constexpr int some_first_bases = 16;

Polyline lifted(const TriangleMesh& mesh, const std::vector<Vec3>& normals, const std::vector<int>& walk,
                double by_m) {
  Polyline line;
  for (int v : walk) line.push_back(mesh.vertices[v] + by_m * normals[v]);
  return line;
}

using ClassedLoop = std::pair<HomologyClass, EdgeLoop>;

std::vector<ClassedLoop> shortest_first(const ShortestLoops& loops) {
  std::vector<ClassedLoop> list(loops.begin(), loops.end());
  std::sort(list.begin(), list.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
  return list;
}

/// What of the surface's loops is linked with what lies outside and inside, over Z2: answers for any class
/// once it is known for a basis.
class Sides {
 public:
  Sides(const TriangleMesh& mesh, const std::vector<ClassedLoop>& loops, LoopSearch& search) {
    const auto normals = geometry::vertex_normals(mesh);
    const double lift_m = lift_edges * geometry::mean_edge_m(mesh);
    std::vector<Polyline> on, above;
    for (const auto& [bits, loop] : loops) {
      if (!basis_.take(bits)) continue;
      loops_.emplace_back(bits, loop);
      const auto walk = search.walk(loop);
      on.push_back(lifted(mesh, normals, walk, 0));
      above.push_back(lifted(mesh, normals, walk, lift_m));
    }
    odd_.assign(on.size(), std::vector<char>(on.size()));
    for (std::size_t i = 0; i < on.size(); ++i)
      for (std::size_t j = 0; j < on.size(); ++j)
        odd_[i][j] = static_cast<char>(linking_number(on[i], above[j]).value & 1);
  }

  const std::vector<ClassedLoop>& basis() const { return loops_; }  ///< the shortest one of what it was given

  LoopKind kind(const HomologyClass& bits) {
    std::vector<int> parts;
    basis_.take(bits, &parts);  // a sum of the basis: it is complete
    bool around = true, through = true;
    for (std::size_t j = 0; j < odd_.size(); ++j) {
      char outside = 0, inside = 0;
      for (int i : parts) {
        outside ^= odd_[i][j];  // the loop with all that is lifted outside
        inside ^= odd_[j][i];   // the loop, lifted, with all that then is inside
      }
      around = around && !outside;
      through = through && !inside;
    }
    return around ? LoopKind::around : through ? LoopKind::through : LoopKind::mixed;
  }

 private:
  Independence basis_;
  std::vector<ClassedLoop> loops_;
  std::vector<std::vector<char>> odd_;
};

struct Chosen {
  std::vector<ClassedLoop> loops;
  std::vector<LoopKind> kinds;
};

/// The shortest independent loops around, and those through, of what was found.
Chosen choose(const ShortestLoops& found, int genus, Sides& sides) {
  Chosen chosen;
  Independence around, through;
  for (const auto& loop : shortest_first(found)) {
    if (around.size() == genus && through.size() == genus) break;
    const LoopKind kind = sides.kind(loop.first);
    if (kind == LoopKind::mixed) continue;
    if (!(kind == LoopKind::around ? around : through).take(loop.first)) continue;
    chosen.loops.push_back(loop);
    chosen.kinds.push_back(kind);
  }
  return chosen;
}

/// A vertex to search from, and how long the loops are that the search is for.
struct Base {
  int vertex;
  double most_m;
};

/// Every loop that could replace one of `basis` passes a base that looks far enough: it is shorter than some
/// loop of the basis that is a part of it, and so uses an edge that this part alone counts. Longest first.
std::vector<Base> bases_for(const TriangleMesh& mesh, const NumberedEdges& edges, const EdgeClasses& classes,
                            std::vector<ClassedLoop> basis) {
  std::sort(basis.begin(), basis.end(), [](const auto& a, const auto& b) { return b.second < a.second; });
  Independence parts_of;
  for (const auto& [bits, loop] : basis) parts_of.take(bits);
  std::vector<std::array<int, 2>> ends(edges.count);
  for (std::size_t f = 0; f < edges.of.size(); ++f)
    for (int i = 0; i < 3; ++i) ends[edges.of[f][i]] = {mesh.triangles[f][i], mesh.triangles[f][(i + 1) % 3]};
  std::vector<std::vector<int>> counted(basis.size());  // edges by the part that they count
  for (int e : classes.crossed) {
    std::vector<int> parts;
    parts_of.take(classes.of_edge(e), &parts);
    for (int part : parts) counted[part].push_back(e);
  }
  std::vector<char> taken(mesh.vertices.size(), 0);
  std::vector<Base> bases;
  for (std::size_t part = 0; part < basis.size(); ++part) {
    std::vector<int> degree(mesh.vertices.size(), 0);
    for (int e : counted[part])
      for (int v : ends[e]) ++degree[v];
    for (int e : counted[part]) {
      const auto [v, w] = ends[e];
      if (taken[v] || taken[w]) continue;
      bases.push_back({degree[v] >= degree[w] ? v : w, basis[part].second.length_m});
      taken[bases.back().vertex] = 1;
    }
  }
  return bases;
}

void keep_shorter(const ShortestLoops& from, ShortestLoops& to) {
  for (const auto& [bits, loop] : from) {
    const auto [at, fresh] = to.try_emplace(bits, loop);
    if (!fresh && loop < at->second) at->second = loop;
  }
}

ShortestLoops search_all(const LoopSearch& ready, const std::vector<Base>& bases) {
  ShortestLoops all;
#pragma omp parallel
  {
    LoopSearch search = ready;
    ShortestLoops mine;
#pragma omp for schedule(dynamic, 4)
    for (int i = 0; i < static_cast<int>(bases.size()); ++i)
      search.run(bases[i].vertex, bases[i].most_m, mine);
#pragma omp critical
    keep_shorter(mine, all);  // the least of a strict order: whoever comes first
  }
  return all;
}

/// Some bases that look everywhere, for each bit on edges that have it: all components with a handle are
/// seen, and what one base finds makes up all classes of its component.
std::vector<Base> first_bases(const TriangleMesh& mesh, const NumberedEdges& edges,
                              const EdgeClasses& classes) {
  std::vector<int> an_end(edges.count);
  for (std::size_t f = 0; f < edges.of.size(); ++f)
    for (int i = 0; i < 3; ++i) an_end[edges.of[f][i]] = mesh.triangles[f][i];
  const std::size_t each = std::max(1, some_first_bases / classes.bits);
  std::vector<Base> bases;
  for (int k = 0; k < classes.bits; ++k) {
    std::vector<int> counted;
    for (int e : classes.crossed)
      if (classes.row(e)[k / 64] >> (k % 64) & 1) counted.push_back(e);
    for (std::size_t i = 0; i < each; ++i)
      bases.push_back({an_end[counted[counted.size() * i / each]], std::numeric_limits<double>::infinity()});
  }
  return bases;
}

}  // namespace

std::vector<SurfaceLoop> handle_loops(const TriangleMesh& mesh) {
  const NumberedEdges edges(mesh);
  const EdgeClasses classes = edge_classes(mesh, edges);
  if (classes.bits == 0) return {};
  const int genus = classes.bits / 2;
  LoopSearch search(mesh, edges, classes);
  ShortestLoops found = search_all(search, first_bases(mesh, edges, classes));
  Sides sides(mesh, shortest_first(found), search);
  Chosen chosen = choose(found, genus, sides);
  const bool complete = std::ssize(chosen.loops) == classes.bits;
  keep_shorter(search_all(search, bases_for(mesh, edges, classes, complete ? chosen.loops : sides.basis())),
               found);
  chosen = choose(found, genus, sides);

  std::vector<SurfaceLoop> loops;
  for (std::size_t i = 0; i < chosen.loops.size(); ++i) {
    const auto walk = search.walk(chosen.loops[i].second);
    loops.push_back(loop_of(mesh, pull_tight(mesh, edges, string_along(mesh, edges, walk))));
    loops.back().kind = chosen.kinds[i];
  }
  std::stable_sort(loops.begin(), loops.end(),
                   [](const auto& a, const auto& b) { return a.length_m < b.length_m; });
  return loops;
}

}  // namespace geocage::topology
