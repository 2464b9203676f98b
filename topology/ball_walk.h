#pragma once
#include <cstdint>
#include <vector>

#include "topology/ball_mesh.h"
#include "topology/ball_steps.h"

namespace geocage::topology {

/// The ball of one lane, as a region's masks hold it: `slot` of a vertex leads to its mask, the lane is a bit
/// of one of its words.
struct LaneBall {
  const int* slot;
  const std::uint64_t* masks;  ///< the word that holds the lane, of slot 0 (outside: all zero)
  std::uint64_t bit;
  bool has(int vertex) const { return (masks[2 * static_cast<std::ptrdiff_t>(slot[vertex])] & bit) != 0; }
};

/// One section to measure: of the cut of the ball around `source` (rank) with the plane through `center`
/// normal to `axis`, the connected piece nearest to the source, as Cutter::cut chooses it. The angles (see
/// BallFields) are NaN where the plane meets no triangle of the ball.
struct CutTask {
  LaneBall ball;
  int source;
  geometry::Vec3 center, axis;
  double winding_rad, accumulated_rad;
};

/// Measures sections of balls by walking along them from triangle to triangle, several at a time so that one
/// waits for memory while others go on. Keeps its memory: one for each thread.
class SectionWalker {
 public:
  SectionWalker(const BallMesh& mesh, const class VertexGrid& grid);
  void measure(std::vector<CutTask>& tasks);

  int searched_whole = 0;  ///< how often the first piece could not be proved to be the nearest

 private:
  using Plane = CutPlane;
  using End = CutEnd;
  using Tip = WalkTip;
  /// Where a walk starts: the edge, or -1, and the distance from the source to where the plane cuts it.
  struct Start {
    int half_edge = -1;
    double distance2;
    bool at_source;  ///< an edge of the source itself
    bool one_run;    ///< all edges of its vertex that cross the plane in the ball are side by side
  };
  struct Walk {
    Plane plane;
    Start start;
    Tip ahead, behind;
    double nearest2;  ///< how near it comes to the source, where all of it has been looked at
  };

  Plane make_plane(const geometry::Vec3& center, const geometry::Vec3& axis,
                   const geometry::Vec3& source) const;
  double height(const Plane& plane, int vertex) const;
  double along_v(const Plane& plane, int vertex) const;
  double u_of(const Plane& plane, const int* ends, const End* places) const {
    return along_u(plane, &mesh_.points[0].x, ends, places);
  }
  bool crosses(const Plane& plane, int a, int b) const {
    return (height(plane, a) >= 0) != (height(plane, b) >= 0);
  }
  static double cut_distance2(const Plane& plane, const double* p, double h, const double* q, double g);
  double point_distance2(const Plane& plane, Crossing crossing) const;
  double segment_distance2(const Plane& plane, int a, int b, int c) const;
  bool bounds_triangle(const LaneBall& ball, int half_edge) const;
  Start first_crossing(const LaneBall& ball, const Plane& plane, int source) const;
  Tip tip_at(const Plane& plane, int half_edge) const;
  Tip turned(const Tip& tip) const;
  bool advance(const LaneBall& ball, const Plane& plane, Tip& tip) const;
  void walk(const std::vector<CutTask>& tasks, Tip Walk::*which);
  void take_angles(const Walk& walk, CutTask& task) const;
  double nearest_noted2(const Walk& walk) const;
  template <class Walked>
  bool is_nearest(const CutTask& task, const Walk& walk, double bound2, const Walked& walked);
  bool is_nearest(const CutTask& task, const Walk& walk);
  void search_whole(CutTask& task, const Plane& plane);
  double walk_noting_all(const LaneBall& ball, const Plane& plane, Tip& tip,
                         std::vector<Crossing>& all) const;
  Walk walk_both_ways(const LaneBall& ball, const Plane& plane, int half_edge,
                      std::vector<Crossing>& all) const;

  const BallMesh& mesh_;
  const VertexGrid& grid_;
  std::vector<Walk> walks_;
  std::vector<SectionSteps> steps_;
  std::vector<char> seen_;  ///< in the queue, while a ball is searched whole
  std::vector<int> queue_, near_;
};

/// Vertices by the cells of a cubic grid of about two edges' length, at most four cells a vertex.
class VertexGrid {
 public:
  static constexpr int most_found = 1000;
  explicit VertexGrid(const BallMesh& mesh);
  /// At least all vertices with a triangle that may come within `radius_m` of p, into `found` (most_found +
  /// 16 of room), and their number; -1 where these are too many.
  int around(const double* p, double radius_m, int* found) const;

 private:
  int cell(int axis, double x) const {
    const double c = (x - low_[axis]) * per_m_;
    return c <= 0 ? 0 : c >= cells_[axis] ? cells_[axis] - 1 : static_cast<int>(c);
  }
  double low_[3], per_m_, longest_reach_m_ = 0;
  int cells_[3];
  std::vector<int> start_, items_;
  std::vector<float> at_m_[3], reach_m_;  ///< of the items, from the grid's corner
};

}  // namespace geocage::topology
