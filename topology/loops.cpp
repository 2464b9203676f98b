#include "topology/loops.h"

#include <algorithm>
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
constexpr int first_bases = 8;

Polyline lifted(const TriangleMesh& mesh, const std::vector<Vec3>& normals, const std::vector<int>& walk,
                double by_m) {
  Polyline line;
  for (int v : walk) line.push_back(mesh.vertices[v] + by_m * normals[v]);
  return line;
}

/// Vertices that every loop of a class other than 0 passes: an end of each edge that has a bit.
std::vector<int> bases_of(const TriangleMesh& mesh, const NumberedEdges& edges, const EdgeClasses& classes) {
  std::vector<std::array<int, 2>> ends(edges.count);
  for (std::size_t f = 0; f < edges.of.size(); ++f)
    for (int i = 0; i < 3; ++i) ends[edges.of[f][i]] = {mesh.triangles[f][i], mesh.triangles[f][(i + 1) % 3]};
  std::vector<int> degree(mesh.vertices.size(), 0);
  for (int e : classes.crossed)
    for (int v : ends[e]) ++degree[v];
  std::vector<char> taken(mesh.vertices.size(), 0);
  std::vector<int> bases;
  for (int e : classes.crossed) {
    const auto [v, w] = ends[e];
    if (taken[v] || taken[w]) continue;
    const int base = degree[v] >= degree[w] ? v : w;
    taken[base] = 1;
    bases.push_back(base);
  }
  return bases;
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
      longest_m_ = std::max(longest_m_, loop.length_m);
      const auto walk = search.walk(loop);
      on.push_back(lifted(mesh, normals, walk, 0));
      above.push_back(lifted(mesh, normals, walk, lift_m));
    }
    odd_.assign(on.size(), std::vector<char>(on.size()));
    for (std::size_t i = 0; i < on.size(); ++i)
      for (std::size_t j = 0; j < on.size(); ++j)
        odd_[i][j] = static_cast<char>(linking_number(on[i], above[j]).value & 1);
  }

  double longest_m() const { return longest_m_; }  ///< of the basis

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
  double longest_m_ = 0;
  std::vector<std::vector<char>> odd_;
};

struct Chosen {
  std::vector<std::pair<EdgeLoop, LoopKind>> loops;
  double longest_m = 0;
  bool complete = false;
};

/// The shortest independent loops around, and those through, of what was found.
Chosen choose(const ShortestLoops& found, int genus, Sides& sides) {
  Chosen chosen;
  Independence around, through;
  for (const auto& [bits, loop] : shortest_first(found)) {
    if (around.size() == genus && through.size() == genus) break;
    const LoopKind kind = sides.kind(bits);
    if (kind == LoopKind::mixed) continue;
    Independence& kin = kind == LoopKind::around ? around : through;
    if (!kin.take(bits)) continue;
    chosen.loops.emplace_back(loop, kind);
    chosen.longest_m = std::max(chosen.longest_m, loop.length_m);
  }
  chosen.complete = around.size() == genus && through.size() == genus;
  return chosen;
}

void keep_shorter(const ShortestLoops& from, ShortestLoops& to) {
  for (const auto& [bits, loop] : from) {
    const auto [at, fresh] = to.try_emplace(bits, loop);
    if (!fresh && loop < at->second) at->second = loop;
  }
}

/// Searches from all bases for loops that are no longer than `most_m`.
ShortestLoops search_all(const LoopSearch& ready, const std::vector<int>& bases, double most_m) {
  ShortestLoops all;
#pragma omp parallel
  {
    LoopSearch search = ready;
    ShortestLoops mine;
#pragma omp for schedule(dynamic, 4)
    for (int i = 0; i < static_cast<int>(bases.size()); ++i) search.run(bases[i], most_m, mine);
#pragma omp critical
    keep_shorter(mine, all);  // the least of a strict order: whoever comes first
  }
  return all;
}

std::vector<int> spread(const std::vector<int>& bases) {
  std::vector<int> some;
  for (int i = 0; i < first_bases; ++i) some.push_back(bases[bases.size() * i / first_bases]);
  return some;
}

}  // namespace

std::vector<SurfaceLoop> handle_loops(const TriangleMesh& mesh) {
  const NumberedEdges edges(mesh);
  const EdgeClasses classes = edge_classes(mesh, edges);
  if (classes.bits == 0) return {};
  const auto bases = bases_of(mesh, edges, classes);
  LoopSearch search(mesh, edges, classes);

  // A few searches without a bound find a basis; no loop of the answer is longer than its longest.
  ShortestLoops found = search_all(search, spread(bases), std::numeric_limits<double>::infinity());
  Sides sides(mesh, shortest_first(found), search);
  const Chosen first = choose(found, classes.bits / 2, sides);
  keep_shorter(search_all(search, bases, first.complete ? first.longest_m : 4 * sides.longest_m()), found);

  std::vector<SurfaceLoop> loops;
  for (const auto& [loop, kind] : choose(found, classes.bits / 2, sides).loops) {
    const auto string = pull_tight(mesh, edges, string_along(mesh, edges, search.walk(loop)));
    loops.push_back(loop_of(mesh, string));
    loops.back().kind = kind;
  }
  std::stable_sort(loops.begin(), loops.end(),
                   [](const auto& a, const auto& b) { return a.length_m < b.length_m; });
  return loops;
}

}  // namespace geocage::topology
