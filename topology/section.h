#pragma once
#include <array>
#include <cmath>
#include <vector>

#include "geometry/mesh.h"

namespace geocage::topology {

using geometry::Vec3;

/// A number for each edge of a mesh: `of[f][i]` is that of the edge from corner i to corner i + 1 of triangle
/// f, and `across[f][i]` the triangle on its other side, or -1. Precondition: edges are manifold.
struct NumberedEdges {
  std::vector<std::array<int, 3>> of, across;
  int count = 0;
  explicit NumberedEdges(const geometry::TriangleMesh& mesh);
};

/// The piece of a ball's cut that is measured, as points in order; a ring repeats none.
struct Section {
  std::vector<Vec3> path;
  std::vector<std::array<int, 2>> edges;  ///< of each point: the edge it lies on, as vertex above and below
  bool closed = false;
};

/// Which side of a plane p is on: axis . p - offset, added up in the same order everywhere, so that two ways
/// to cut a ball agree on every vertex. >= 0 is above.
inline double plane_height(const double* axis, double offset, const double* p) {
  return axis[0] * p[0] + axis[1] * p[1] + axis[2] * p[2] - offset;
}
/// 1e-11 of the mesh's mean edge below the centre, which is more than rounding: of a ball that is symmetric,
/// the centre can be a vertex, and rounding would decide which way the section goes round it.
inline double plane_offset(const Vec3& axis, const Vec3& center, double mean_edge_m) {
  return plane_height(axis.data(), 1e-11 * mean_edge_m, center.data());
}
/// Of an axis' two directions the one whose first component beyond a half is positive, for the same reason; a
/// little beyond, since the axes of symmetric balls have components of a half.
inline Vec3 directed(const Vec3& axis) {
  for (int i = 0; i < 3; ++i)
    if (std::abs(axis[i]) > 0.500001) return axis[i] < 0 ? Vec3(-axis) : axis;
  return axis;
}

/// Cuts triangles of a mesh with planes. Keeps its memory between cuts: one for each thread.
class Cutter {
 public:
  Cutter(const geometry::TriangleMesh& mesh, const NumberedEdges& edges)
      : mesh_(mesh),
        edges_(edges),
        mean_edge_m_(mean_edge_m(mesh)),
        known_(static_cast<std::size_t>(edges.count), -1) {}

  /// The plane goes through `center` with unit normal `axis`; of the cut, the connected piece that comes
  /// nearest to p. Empty when the plane meets no triangle. A vertex on the plane counts as above it.
  /// O(triangles).
  Section cut(const std::vector<int>& triangles, const Vec3& p, const Vec3& center, const Vec3& axis);

 private:
  /// Where the plane cuts an edge, and the (one or two) cut points it is joined to.
  struct CutPoint {
    int edge;
    std::array<int, 2> ends;  ///< above, below
    Vec3 p;
    std::array<int, 2> next = {-1, -1};
    void join(int other) { next[next[0] >= 0] = other; }
  };
  void find_points(const std::vector<int>& triangles, const Vec3& center, const Vec3& axis);
  Section walk(int from);

  const geometry::TriangleMesh& mesh_;
  const NumberedEdges& edges_;
  const double mean_edge_m_;
  std::vector<CutPoint> points_;
  std::vector<int> known_;  ///< edge -> its cut point, or -1
  std::vector<char> taken_;
};

/// The path of mesh edges along a section: of each cut edge the end nearer to the plane, projected onto it
/// (the thesis's edge path). Neighbours in it share an edge, since cut edges that follow each other share a
/// triangle.
Section along_edges(const Section& section, const geometry::TriangleMesh& mesh, const Vec3& center,
                    const Vec3& axis);

/// The angle that a section runs through around `center`, in all its turns; NaN for an empty one.
double accumulated_angle_rad(const Section& section, const Vec3& center, const Vec3& axis);

/// Winding angle W in [pi, 2 pi] of a section around `center` (thesis 3.5): the angle that the path runs
/// through, at least half a turn and at most a full one; 2 pi for a ring. NaN for an empty one.
double winding_angle_rad(const Section& section, const Vec3& center, const Vec3& axis);

}  // namespace geocage::topology
