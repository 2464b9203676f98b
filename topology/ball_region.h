#pragma once
#include <cstdint>
#include <vector>

#include "topology/ball_mesh.h"
#include "topology/ball_rows.h"

namespace geocage::topology {

/// Vertices grouped into compact patches of at most `lanes`; a patch's balls are grown together.
struct Patches {
  std::vector<int> sources;  ///< ranks, each vertex once
  std::vector<int> start;    ///< of each patch, and the end
  int count() const { return static_cast<int>(start.size()) - 1; }
};
Patches make_patches(const BallMesh& mesh);

/// All vertices within reach of a patch, renumbered in the order of their distance from it, with their
/// neighbours split by that order. Keeps its memory: one for each thread.
class Region {
 public:
  explicit Region(const BallMesh& mesh) : mesh_(mesh), slot_(static_cast<std::size_t>(mesh.count) + 1) {}

  /// Within `hops` edges of a source. Returns the rings' number: 1 + the greatest distance from the patch.
  void grow_by_hops(const int* sources, int count, int hops);
  /// Within `radius_m` along edges; weights are edge lengths in units of `quantum_m`, rounded to whole
  /// numbers.
  void grow_by_length(const int* sources, int count, double radius_m, double quantum_m);

  int size() const { return static_cast<int>(order_.size()); }
  int rings() const { return static_cast<int>(ring_start_.size()) - 1; }
  int ring_start(int ring) const { return ring_start_[ring]; }
  int patch() const { return patch_; }
  const std::vector<int>& order() const { return order_; }
  /// 1 + the place of a vertex in the order, or 0 outside the region.
  const int* slot() const { return slot_.data(); }
  /// Cells (triangles, edges, the vertex) whose last corner is each vertex.
  const std::vector<OwnCells>& own() const { return own_; }
  /// The last neighbour of each vertex in the order; beyond all where one is outside or the link has a gap.
  const std::vector<int>& farthest() const { return farthest_; }
  RegionView view() const;

 private:
  void clear();
  void take(int rank) {
    order_.push_back(rank);
    slot_[rank] = static_cast<int>(order_.size());
  }
  void link_region(double quantum_m);
  void link_vertex(int i, int ring_end);

  const BallMesh& mesh_;
  std::vector<int> slot_, order_, ring_start_, start_, middle_, outer_, near_, farthest_, same_, later_;
  std::vector<std::uint32_t> weight_;
  std::vector<OwnCells> own_;
  std::vector<double> length_;  ///< by slot
  int patch_ = 0;
};

}  // namespace geocage::topology
