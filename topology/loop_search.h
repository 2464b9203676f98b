#pragma once
#include <map>
#include <tuple>
#include <vector>

#include "topology/homology.h"

namespace geocage::topology {

/// A closed walk on edges: the shortest paths from `base` to both ends of `edge`, and the edge.
struct EdgeLoop {
  double length_m;
  int base, v, w;

  bool operator<(const EdgeLoop& other) const {  // a strict order: equal lengths are common on regular meshes
    return std::tie(length_m, base, v, w) < std::tie(other.length_m, other.base, other.v, other.w);
  }
};
using ShortestLoops = std::map<HomologyClass, EdgeLoop>;

/// Finds the shortest such loop of each class that is not 0. Keeps its memory between searches: one a thread.
class LoopSearch {
 public:
  LoopSearch(const geometry::TriangleMesh& mesh, const NumberedEdges& edges, const EdgeClasses& classes);

  /// Loops through `base` that are no longer than `most_length_m`, put into `best` where they beat it.
  void run(int base, double most_length_m, ShortestLoops& best);

  /// The vertices of a loop in order; those of its two paths that both go through are left out. Searches
  /// again.
  std::vector<int> walk(const EdgeLoop& loop);

 private:
  struct Arc {
    int to, edge;
    double length_m;
  };
  void dijkstra(int base, double most_m);
  std::vector<int> path_to(int v) const;
  std::uint64_t* row(int v) { return class_.data() + static_cast<std::size_t>(v) * classes_.words; }

  const EdgeClasses& classes_;
  std::vector<int> start_;
  std::vector<Arc> arcs_;
  std::vector<double> distance_;
  std::vector<int> parent_, settled_;
  std::vector<std::uint64_t> class_;  ///< of the path from the base, by vertex
  std::vector<std::pair<double, int>> heap_;
};

}  // namespace geocage::topology
