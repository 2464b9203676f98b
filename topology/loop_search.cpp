#include "topology/loop_search.h"

#include <algorithm>
#include <functional>
#include <limits>

namespace geocage::topology {

namespace {

constexpr double unreached = std::numeric_limits<double>::infinity();

}  // namespace

LoopSearch::LoopSearch(const geometry::TriangleMesh& mesh, const NumberedEdges& edges,
                       const EdgeClasses& classes)
    : classes_(classes) {
  const std::size_t n = mesh.vertices.size();
  start_.assign(n + 1, 0);
  for (const auto& t : mesh.triangles)
    for (int v : t) ++start_[v + 1];  // closed: as many edges as triangles around a vertex
  for (std::size_t v = 0; v < n; ++v) start_[v + 1] += start_[v];
  arcs_.resize(static_cast<std::size_t>(start_[n]));
  auto next = start_;
  for (std::size_t f = 0; f < mesh.triangles.size(); ++f)
    for (int i = 0; i < 3; ++i) {  // each edge runs from v to w in one triangle, back in the other
      const int v = mesh.triangles[f][i], w = mesh.triangles[f][(i + 1) % 3];
      arcs_[next[v]++] = {w, edges.of[f][i], (mesh.vertices[v] - mesh.vertices[w]).norm()};
    }
  distance_.assign(n, unreached);
  parent_.assign(n, -1);
  class_.assign(n * classes.words, 0);
}

void LoopSearch::dijkstra(int base, double most_m) {
  for (int v : settled_) distance_[v] = unreached;
  settled_.clear();
  heap_.assign(1, {0, base});
  distance_[base] = 0;
  parent_[base] = -1;
  std::fill_n(row(base), classes_.words, 0);
  while (!heap_.empty()) {
    std::pop_heap(heap_.begin(), heap_.end(), std::greater<>());
    const auto [d, v] = heap_.back();
    heap_.pop_back();
    if (d > distance_[v]) continue;
    settled_.push_back(v);
    for (int i = start_[v]; i < start_[v + 1]; ++i) {
      const Arc& arc = arcs_[i];
      const double there = d + arc.length_m;
      if (there >= distance_[arc.to] || there > most_m) continue;
      distance_[arc.to] = there;
      parent_[arc.to] = v;
      for (std::size_t k = 0; k < classes_.words; ++k) row(arc.to)[k] = row(v)[k] ^ classes_.row(arc.edge)[k];
      heap_.emplace_back(there, arc.to);
      std::push_heap(heap_.begin(), heap_.end(), std::greater<>());
    }
  }
}

void LoopSearch::run(int base, double most_length_m, ShortestLoops& best) {
  dijkstra(base, most_length_m / 2);
  HomologyClass sum(classes_.words);
  for (int v : settled_)
    for (int i = start_[v]; i < start_[v + 1]; ++i) {
      const Arc& arc = arcs_[i];
      const EdgeLoop loop = {distance_[v] + arc.length_m + distance_[arc.to], base, v, arc.to};
      if (arc.to < v || loop.length_m > most_length_m) continue;  // also where it was not reached
      std::uint64_t any = 0;
      for (std::size_t k = 0; k < classes_.words; ++k)
        any |= sum[k] = row(v)[k] ^ row(arc.to)[k] ^ classes_.row(arc.edge)[k];
      if (any == 0 || distance_[arc.to] == unreached) continue;
      const auto [at, fresh] = best.try_emplace(sum, loop);
      if (!fresh && loop < at->second) at->second = loop;
    }
}

std::vector<int> LoopSearch::path_to(int v) const {
  std::vector<int> path;
  for (; v >= 0; v = parent_[v]) path.push_back(v);
  return path;  // v .. base
}

std::vector<int> LoopSearch::walk(const EdgeLoop& loop) {
  dijkstra(loop.base, loop.length_m);
  auto first = path_to(loop.v), second = path_to(loop.w);
  int fork = loop.base;
  while (!first.empty() && !second.empty() && first.back() == second.back()) {
    fork = first.back();
    first.pop_back();
    second.pop_back();
  }
  std::vector<int> walk = {fork};
  walk.insert(walk.end(), first.rbegin(), first.rend());
  walk.insert(walk.end(), second.begin(), second.end());
  return walk;
}

}  // namespace geocage::topology
