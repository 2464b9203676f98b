#pragma once
#include <cstdint>
#include <vector>

#include "topology/ball_mesh.h"

namespace geocage::topology {

/// The ball of one lane, as a region's masks hold it: `slot` of a vertex leads to its mask, the lane is a bit of one
/// of its words.
struct LaneBall {
  const int* slot;
  const std::uint64_t* masks;  ///< the word that holds the lane, of slot 0 (outside: all zero)
  std::uint64_t bit;
  bool has(int vertex) const { return (masks[2 * static_cast<std::ptrdiff_t>(slot[vertex])] & bit) != 0; }
};

/// Angles of one section; see BallFields.
struct CutAngles {
  double winding_rad, accumulated_rad;
};

/// Measures the section of a ball by walking along it from triangle to triangle. Keeps its memory: one for each
/// thread.
class SectionWalker {
 public:
  SectionWalker(const BallMesh& mesh, const class VertexGrid& grid) : mesh_(mesh), grid_(grid) {}

  /// Of the cut of the ball around `source` (rank) with the plane through `center` normal to `axis`, the connected
  /// piece nearest to the source, as Cutter::cut chooses it. NaN where the plane meets no triangle of the ball.
  CutAngles measure(const LaneBall& ball, int source, const geometry::Vec3& center, const geometry::Vec3& axis);

  int searched_whole = 0;  ///< how often the first piece could not be proved to be the nearest

 private:
  /// The vertex' height over the plane and its place in it, from the centre.
  struct Place {
    double height, u, v;
  };
  struct Plane {
    double axis[3], offset, u[3], v[3], center[3];
  };
  /// A walk's tip: the half-edge through which it enters the next triangle, and its ends above and below.
  struct Tip {
    int half_edge, above, below;
    bool from_above;
    Place up, down;
    double qu, qv;  ///< the cut point from the centre, times a positive number
    int turns = 0;  ///< how often it passed the half-line u < 0, v = 0, counter-clockwise
    bool closed = false;
  };
  /// A crossed edge: (vertex above, vertex below).
  using Crossing = std::uint64_t;

  Place place(int vertex) const;
  void set_plane(const geometry::Vec3& center, const geometry::Vec3& axis);
  bool crosses(int a, int b) const;
  double point_distance2(int above, int below) const;
  double segment_distance2(int a, int b, int c) const;
  int first_crossing(const LaneBall& ball, int source) const;
  Tip tip_at(int half_edge) const;
  bool advance(const LaneBall& ball, Tip& tip) const;
  void walk(const LaneBall& ball, Tip& tip, int home, double& nearest2, bool all);
  CutAngles angles_from(const LaneBall& ball, int half_edge, double& nearest2, bool all);
  bool is_nearest(const LaneBall& ball, double nearest2) const;
  CutAngles search_whole(const LaneBall& ball, int source);

  const BallMesh& mesh_;
  const VertexGrid& grid_;
  Plane plane_{};
  double source_[3] = {};
  std::vector<Crossing> near_;  ///< the crossings of the walk that lie next to its start
};

/// Vertices by the cells of a cubic grid of about two edges' length, at most four cells a vertex.
class VertexGrid {
 public:
  explicit VertexGrid(const BallMesh& mesh);
  /// Calls `see(vertex)` for at least all vertices within `radius_m` of p, until it returns false.
  template <class See>
  bool around(const double* p, double radius_m, const See& see) const {
    int low[3], high[3];
    for (int i = 0; i < 3; ++i) {
      low[i] = cell(i, p[i] - radius_m);
      high[i] = cell(i, p[i] + radius_m);
    }
    for (int z = low[2]; z <= high[2]; ++z)
      for (int y = low[1]; y <= high[1]; ++y) {
        const std::ptrdiff_t row = (static_cast<std::ptrdiff_t>(z) * cells_[1] + y) * cells_[0];
        for (int i = start_[row + low[0]]; i < start_[row + high[0] + 1]; ++i)
          if (!see(items_[i])) return false;
      }
    return true;
  }

 private:
  int cell(int axis, double x) const {
    const double c = (x - low_[axis]) * per_m_;
    return c <= 0 ? 0 : c >= cells_[axis] ? cells_[axis] - 1 : static_cast<int>(c);
  }
  double low_[3], per_m_;
  int cells_[3];
  std::vector<int> start_, items_;
};

}  // namespace geocage::topology
