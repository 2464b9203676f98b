#pragma once
#include <array>
#include <cstdint>
#include <mutex>
#include <span>
#include <vector>

#include "topology/ball_mesh.h"
#include "topology/ball_rows.h"

namespace geocage::topology {

/// Groups vertices into compact patches of at most `lanes`, whose balls are grown together: each vertex is in
/// one of them, and they come in the same order whoever asks. Any thread may ask for the next one. They are
/// made when they are asked for first, and kept.
class Patches {
 public:
  explicit Patches(const BallMesh& mesh);
  /// The ranks of the next patch; none when all have been given out.
  std::span<const int> next();
  /// The first patch is next again.
  void rewind() { given_out_ = 0; }

 private:
  void make_next();
  void order(std::span<int> patch) const;
  const BallMesh& mesh_;
  std::mutex mutex_;
  std::vector<int> members_;   ///< patch after patch; never moves
  std::vector<int> start_;     ///< of each patch that is made, and the next one's
  std::size_t given_out_ = 0;  ///< so many patches
  int seed_ = 0;               ///< all before it are in a patch
  std::vector<char> taken_;    ///< whether a vertex is
  std::vector<int> slot_, queue_;
};

/// Lengths of a mesh's links in whole quanta.
struct LinkWeights {
  std::vector<std::uint32_t> of_link;
  std::uint32_t mean = 0, longest = 0;
};

/// All vertices within reach of a patch, renumbered in the order of their distance from it, with their
/// neighbours split by that order. Keeps its memory: one for each thread.
class Region {
 public:
  explicit Region(const BallMesh& mesh) : mesh_(mesh), slot_(static_cast<std::size_t>(mesh.count) + 1) {}

  /// Within `hops` edges of a source. Returns the rings' number: 1 + the greatest distance from the patch.
  void grow_by_hops(const int* sources, int count, int hops);
  /// Within `limit` along edges, `weights` being the lengths of the mesh's links, each at most 2^30; in
  /// rings of hops all the same. Precondition: limit < 2^31.
  void grow_by_length(const int* sources, int count, std::uint32_t limit, const LinkWeights& weights);

  int size() const { return size_; }
  /// How many vertices from the first on hold all that lie within `distance` of the patch (hops, or quanta).
  int size_within(std::uint32_t distance) const {
    int ring = rings();
    while (ring > 0 && ring_low_[ring - 1] > distance) --ring;
    return ring_start_[ring];
  }
  int rings() const { return static_cast<int>(ring_start_.size()) - 1; }
  int ring_start(int ring) const { return ring_start_[ring]; }
  int patch() const { return patch_; }
  const int* order() const { return order_.data(); }
  /// 1 + the place of a vertex in the order, or 0 outside the region.
  const int* slot() const { return slot_.data(); }
  /// Cells (triangles, edges, the vertex) whose last corner is each vertex.
  const std::vector<OwnCells>& own() const { return own_; }
  /// The last neighbour of each vertex in the order; beyond all where one is outside or the link has a gap.
  const std::vector<int>& farthest() const { return farthest_; }
  RegionView view() const;

 private:
  void clear();
  void order_by_hops(const int* sources, int count, int hops, const std::uint32_t* distance);
  void reach_from(int v, std::uint32_t limit, const LinkWeights& weights);
  void link_region(const std::uint32_t* weights);

  const BallMesh& mesh_;
  std::vector<int> slot_, order_, ring_start_, start_, middle_, outer_, near_, farthest_;
  std::vector<int> reached_;             ///< while a search by length runs
  std::vector<std::uint32_t> ring_low_;  ///< no vertex of a ring is nearer to the patch
  std::vector<std::uint32_t> weight_;
  std::vector<OwnCells> own_;
  std::vector<std::uint32_t> distance_;  ///< of each vertex from the patch; far but while a search runs
  struct Reached {
    std::uint32_t distance;
    int vertex;
  };
  static constexpr std::uint32_t buckets = 256;
  std::array<std::vector<Reached>, buckets>
      buckets_;  ///< those reached, by distance / width_, round and round
  std::uint32_t width_ = 1;
  int waiting_ = 0;
  int size_ = 0, patch_ = 0;
};

/// Dijkstra's algorithm in doubles, as PlainSearch adds them up. Keeps its memory: one for each thread.
class LengthSearch {
 public:
  struct Found {
    double distance_m;
    int vertex;
    bool operator>(const Found& other) const { return distance_m > other.distance_m; }
  };
  explicit LengthSearch(const BallMesh& mesh) : mesh_(mesh) {}
  /// All vertices within `limit_m` of the source, by distance.
  const std::vector<Found>& run(int source, double limit_m);

 private:
  const BallMesh& mesh_;
  std::vector<Found> found_, heap_;
  std::vector<char> done_;
};

}  // namespace geocage::topology
