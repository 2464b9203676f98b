#pragma once
#include <array>
#include <vector>

#include "geometry/mesh.h"
#include "topology/ball_rows.h"

namespace geocage::topology {

/// The steps around all vertices, counter-clockwise from outside and cyclic: a neighbour, the half-edge to it
/// (-1: none), and the area of the triangle between it and the next one (0: there is none). Searches read
/// some beyond the last one.
struct Links {
  std::vector<int> neighbour, half_edge;
  std::vector<double> area_m2;
  void resize(std::size_t count) {
    neighbour.resize(count + spare_links);
    half_edge.resize(count);
    area_m2.resize(count + spare_links);
  }
};

/// A mesh laid out for searches around all of its vertices: vertices in the order of a Hilbert curve, so that
/// what lies near on the surface lies near in memory. Vertices go by their rank in that order.
struct BallMesh {
  int count = 0;              ///< vertices; as a neighbour, `count` is a gap in the ring of a border vertex
  std::vector<int> original;  ///< rank -> vertex of the mesh
  struct alignas(32) Point {
    double x, y, z, defect_rad;
  };
  std::vector<Point> points;
  std::vector<int> link_start;  ///< count + 1
  Links links;

  /// The side from corner i to corner i + 1 of triangle f is half-edge 3 f + i. `exits` are the half-edges on
  /// the other side of the next and of the second next side of its triangle, or -1 at a border.
  struct HalfEdge {
    int opposite, exits[2], from;
  };
  std::vector<HalfEdge> half_edges;
  double mean_edge_m = 0, longest_edge_m = 0;
  std::vector<float> longest_m;  ///< longest side of the triangles at each vertex, rounded

  /// Precondition: edges are manifold and oriented alike. O(V log V).
  explicit BallMesh(const geometry::TriangleMesh& mesh);

  geometry::Vec3 position(int rank) const { return {points[rank].x, points[rank].y, points[rank].z}; }
  int twin(int half_edge) const { return half_edges[after(half_edge)].exits[1]; }

  int to(int half_edge) const { return half_edges[after(half_edge)].from; }

 private:
  static int after(int half_edge) { return half_edge % 3 == 2 ? half_edge - 2 : half_edge + 1; }
  static int before(int half_edge) { return half_edge % 3 == 0 ? half_edge + 2 : half_edge - 1; }
  /// While it is built: half-edges that leave each vertex, at last in the order of its ring, and of each
  /// triangle twice its area and the square of its longest side.
  struct Draft {
    std::vector<int> start, outgoing;
    std::vector<double> twice_area_m2, longest_m2;
    bool thin = false;  ///< some triangle is so thin that angles had better come from three corners at once
  };
  void order_vertices(const geometry::TriangleMesh& mesh);
  void order_triangles(const geometry::TriangleMesh& mesh);
  void list_outgoing(Draft& draft) const;
  void measure_triangles(Draft& draft) const;
  void join_rings(Draft& draft);
  void link_vertices(const Draft& draft);
  void measure_vertices(const Draft& draft);
};

}  // namespace geocage::topology
