#include "topology/homology.h"

#include <algorithm>
#include <bit>
#include <numeric>

namespace geocage::topology {

using geometry::TriangleMesh;

namespace {

constexpr int starts = 8;

int root_of(std::vector<int>& parent, int v) {
  while (parent[v] != v) v = parent[v] = parent[parent[v]];
  return v;
}

/// Breadth-first tree of triangles (of each component): who led to a triangle, through which edge, how far.
struct TriangleTree {
  std::vector<int> parent, through, depth;

  TriangleTree(const NumberedEdges& edges, int first) {
    const int count = static_cast<int>(edges.of.size());
    parent.assign(count, -1);
    through.assign(count, -1);
    depth.assign(count, -1);
    std::vector<int> queue;
    for (int i = 0; i < count; ++i) {
      const int root = (first + i) % count;
      if (depth[root] >= 0) continue;
      depth[root] = 0;
      queue.assign(1, root);
      for (std::size_t head = 0; head < queue.size(); ++head)
        for (int side = 0; side < 3; ++side) {
          const int f = queue[head], g = edges.across[f][side];
          if (depth[g] >= 0) continue;
          parent[g] = f;
          through[g] = edges.of[f][side];
          depth[g] = depth[f] + 1;
          queue.push_back(g);
        }
    }
  }

  /// Edges that the way through the tree from one triangle to another crosses.
  std::vector<int> way(int f, int g) const {
    std::vector<int> crossed;
    while (f != g) {
      int& lower = depth[f] >= depth[g] ? f : g;
      crossed.push_back(through[lower]);
      lower = parent[lower];
    }
    return crossed;
  }
};

struct Edge {
  int v, w, f, g;
};

std::vector<Edge> list_edges(const TriangleMesh& mesh, const NumberedEdges& edges) {
  std::vector<Edge> list(edges.count);
  for (int f = 0; f < static_cast<int>(edges.of.size()); ++f)
    for (int i = 0; i < 3; ++i)
      if (edges.across[f][i] > f)
        list[edges.of[f][i]] = {mesh.triangles[f][i], mesh.triangles[f][(i + 1) % 3], f, edges.across[f][i]};
  return list;
}

/// The edges that each left-over edge's loop of triangles crosses.
std::vector<std::vector<int>> crossed_by_loops(const TriangleMesh& mesh, const NumberedEdges& edges,
                                               const std::vector<Edge>& list, int first) {
  const TriangleTree tree(edges, first);
  std::vector<char> in_tree(edges.count, 0);
  for (int e : tree.through)
    if (e >= 0) in_tree[e] = 1;
  std::vector<int> free;
  for (int e = 0; e < edges.count; ++e)
    if (!in_tree[e]) free.push_back(e);
  // The vertices' tree takes the edges of the longest loops, so that short ones are left over.
  const auto around = [&](int e) { return tree.depth[list[e].f] + tree.depth[list[e].g]; };
  std::stable_sort(free.begin(), free.end(), [&](int a, int b) { return around(a) > around(b); });
  std::vector<int> parent(mesh.vertices.size());
  std::iota(parent.begin(), parent.end(), 0);
  std::vector<std::vector<int>> loops;
  for (int e : free) {
    const int v = root_of(parent, list[e].v), w = root_of(parent, list[e].w);
    parent[v] = w;
    if (v != w) continue;
    loops.push_back(tree.way(list[e].f, list[e].g));
    loops.back().push_back(e);
  }
  return loops;
}

}  // namespace

EdgeClasses edge_classes(const TriangleMesh& mesh, const NumberedEdges& edges) {
  const auto list = list_edges(mesh, edges);
  const int count = static_cast<int>(mesh.triangles.size());
  std::vector<std::vector<int>> best;
  std::size_t fewest = 0;
  for (int i = 0; i < starts; ++i) {
    auto loops = crossed_by_loops(mesh, edges, list, static_cast<int>(static_cast<long>(count) * i / starts));
    std::size_t crossings = 0;
    for (const auto& loop : loops) crossings += loop.size();
    if (i == 0 || crossings < fewest) {
      fewest = crossings;
      best = std::move(loops);
    }
    if (crossings == 0) break;  // genus 0
  }
  EdgeClasses classes;
  classes.bits = static_cast<int>(best.size());
  classes.words = (best.size() + 63) / 64;
  classes.of.assign(classes.words * static_cast<std::size_t>(edges.count), 0);
  for (std::size_t k = 0; k < best.size(); ++k)
    for (int e : best[k]) {
      classes.of[static_cast<std::size_t>(e) * classes.words + k / 64] |= std::uint64_t{1} << (k % 64);
      classes.crossed.push_back(e);
    }
  std::sort(classes.crossed.begin(), classes.crossed.end());
  classes.crossed.erase(std::unique(classes.crossed.begin(), classes.crossed.end()), classes.crossed.end());
  return classes;
}

bool Independence::take(HomologyClass row, std::vector<int>* parts) {
  HomologyClass made_of((rows_.size() + 64) / 64, 0);
  const auto add = [](HomologyClass& to, const HomologyClass& other) {
    for (std::size_t i = 0; i < std::min(to.size(), other.size()); ++i) to[i] ^= other[i];
  };
  for (const Row& taken : rows_) {
    // A row's leading bit is the lowest one of it; rows taken later don't have it.
    std::size_t word = 0;
    while (taken.bits[word] == 0) ++word;
    const auto lead = std::uint64_t{1} << std::countr_zero(taken.bits[word]);
    if ((row[word] & lead) == 0) continue;
    add(row, taken.bits);
    add(made_of, taken.made_of);
  }
  const bool fresh = std::any_of(row.begin(), row.end(), [](std::uint64_t word) { return word != 0; });
  if (fresh) {
    made_of[rows_.size() / 64] |= std::uint64_t{1} << (rows_.size() % 64);
    rows_.push_back({std::move(row), std::move(made_of)});
  } else if (parts) {
    parts->clear();
    for (int i = 0; i < size(); ++i)
      if (made_of[i / 64] >> (i % 64) & 1) parts->push_back(i);
  }
  return fresh;
}

}  // namespace geocage::topology
