#pragma once
#include <array>
#include <vector>

#include "geometry/mesh.h"
#include "geometry/nearest_packet.h"

namespace geocage::geometry {

/// Nearest triangles of eight points at a time, for points by the thousand that lie side by side: a tree of
/// boxes, each turned along its triangles (Gottschalk et al. 1996). A box around a flat patch is as thin as
/// the patch is flat, so that from far away a few boxes are in question, where boxes along the axes are as
/// thick as the patch is long. Boxes are a little too large, by 1e-9 of the whole. Precondition: at least one
/// triangle, valid indices, finite vertices. Building takes O(F log^2 F); several threads may ask.
class NearestOfEight {
 public:
  explicit NearestOfEight(const TriangleMesh& mesh);

  struct Points {
    std::array<Vec3, 8> points_O;
    std::array<int, 8> nearest;        ///< comes in as any triangles, best ones near the points
    std::array<double, 8> distance_m;  ///< exact but for rounding
  };
  /// The same bits with every instruction set.
  void measure(Points& points) const;

 private:
  using Corners = std::array<Vec3, 3>;
  void build(const std::vector<Corners>& triangles, int begin, int end, double slack_m);

  Vec3 center_;
  std::vector<TurnedBox> boxes_;
  std::vector<FlatTriangle> triangles_;  ///< as leaves hold them
  std::vector<int> order_, place_;       ///< the triangle at each place, the place of each triangle
};

}  // namespace geocage::geometry
