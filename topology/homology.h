#pragma once
#include <cstdint>
#include <vector>

#include "geometry/mesh.h"
#include "topology/section.h"

namespace geocage::topology {

/// Coordinates of a class of closed curves over Z2, one bit for each of 2 x genus generators.
using HomologyClass = std::vector<std::uint64_t>;

/// Bits on edges whose sum over the edges of a closed walk is the walk's class: 0 for one that bounds.
struct EdgeClasses {
  int bits = 0;                   ///< 2 x genus
  std::size_t words = 0;          ///< that hold them
  std::vector<std::uint64_t> of;  ///< by edge, `words` each
  std::vector<int> crossed;       ///< edges with a bit, ascending: every loop that doesn't bound uses one

  const std::uint64_t* row(int edge) const { return of.data() + static_cast<std::size_t>(edge) * words; }
  HomologyClass of_edge(int edge) const { return {row(edge), row(edge) + words}; }
};

/// By a tree of triangles and a tree of vertices that don't cross; each of the 2 x genus edges that are left
/// over closes a loop of triangles, and its bit is set on the edges that this loop crosses (Eppstein 2003).
/// The tree of triangles starts where the loops cross the fewest edges, of some starts. O(F log F).
/// Precondition: closed manifold.
EdgeClasses edge_classes(const geometry::TriangleMesh& mesh, const NumberedEdges& edges);

/// Rows over Z2 with their elimination: which classes are sums of those taken before.
class Independence {
 public:
  /// True, and takes it, if `row` is no sum of what was taken; `parts` of it are the taken ones that add up
  /// to it otherwise, as indices.
  bool take(HomologyClass row, std::vector<int>* parts = nullptr);
  int size() const { return static_cast<int>(rows_.size()); }

 private:
  struct Row {
    HomologyClass bits, made_of;  ///< made_of: bit i for the i-th row that was taken
  };
  std::vector<Row> rows_;
};

}  // namespace geocage::topology
