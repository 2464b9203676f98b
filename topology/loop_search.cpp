#include "topology/loop_search.h"

#include <algorithm>
#include <functional>
#include <limits>

namespace geocage::topology {

namespace {

constexpr double unreached = std::numeric_limits<double>::infinity();

void add(HomologyClass& to, const HomologyClass& other) {
  if (to.empty()) to.resize(other.size());
  for (std::size_t i = 0; i < other.size(); ++i) to[i] ^= other[i];
}
bool is_zero(const HomologyClass& c) {
  return std::all_of(c.begin(), c.end(), [](std::uint64_t word) { return word == 0; });
}

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
  class_.resize(n);
}

void LoopSearch::dijkstra(int base, double most_m) {
  for (int v : settled_) distance_[v] = unreached;
  settled_.clear();
  heap_.assign(1, {0, base});
  distance_[base] = 0;
  parent_[base] = -1;
  class_[base].clear();
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
      class_[arc.to] = class_[v];
      if (!classes_.of[arc.edge].empty()) add(class_[arc.to], classes_.of[arc.edge]);
      heap_.emplace_back(there, arc.to);
      std::push_heap(heap_.begin(), heap_.end(), std::greater<>());
    }
  }
}

void LoopSearch::run(int base, double most_length_m, ShortestLoops& best) {
  dijkstra(base, most_length_m / 2);
  HomologyClass sum;
  for (int v : settled_)
    for (int i = start_[v]; i < start_[v + 1]; ++i) {
      const Arc& arc = arcs_[i];
      if (arc.to < v || distance_[arc.to] == unreached) continue;
      if (class_[v].empty() && class_[arc.to].empty() && classes_.of[arc.edge].empty()) continue;
      sum.clear();
      for (const auto& part :
           {std::cref(class_[v]), std::cref(class_[arc.to]), std::cref(classes_.of[arc.edge])})
        if (!part.get().empty()) add(sum, part.get());
      if (is_zero(sum)) continue;
      const EdgeLoop loop = {distance_[v] + arc.length_m + distance_[arc.to], base, v, arc.to};
      if (loop.length_m > most_length_m) continue;
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
