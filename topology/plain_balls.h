#pragma once
#include <limits>
#include <memory>
#include <vector>

#include "topology/balls.h"

namespace geocage::topology {

/// The oracle of ball_fields: one search a vertex, sums over its vertices, and the section by joining all cut
/// points (section.h). The same fields in the plainest way; O(V x ball).
BallSet plain_ball_fields(const geometry::TriangleMesh& mesh, const std::vector<double>& radii_m,
                          Metric metric, const BallOptions& options = {});

/// The same for some vertices alone, into a set that is there already; what searches share is made once.
class PlainBalls {
 public:
  PlainBalls(const geometry::TriangleMesh& mesh, Metric metric, const BallOptions& options);
  ~PlainBalls();
  PlainBalls(const PlainBalls&) = delete;
  PlainBalls& operator=(const PlainBalls&) = delete;
  void measure(const std::vector<int>& vertices, BallSet& set);

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

/// One thread's desk: the vertices around one source in the order of their distance.
class PlainSearch {
 public:
  PlainSearch(const geometry::TriangleMesh& mesh, const geometry::CompressedRows& neighbours,
              double mean_edge_m)
      : mesh_(mesh),
        neighbours_(neighbours),
        mean_edge_m_(mean_edge_m),
        rank_(mesh.vertices.size(), outside) {}

  void run(int source, double radius_m, Metric metric);
  /// How many vertices of the order lie within `radius_m`.
  int count_within(double radius_m) const;
  int vertex(int rank) const { return order_[rank]; }
  int rank(int vertex) const { return rank_[vertex]; }

 private:
  static constexpr int outside = std::numeric_limits<int>::max();
  void take(int v, double distance_m);
  void breadth_first(int source, double radius_m);
  void dijkstra(int source, double radius_m);

  const geometry::TriangleMesh& mesh_;
  const geometry::CompressedRows& neighbours_;
  const double mean_edge_m_;
  std::vector<int> order_, rank_;
  std::vector<double> distance_m_;
};

/// A radius counts as reached within this factor, so that rounding of sums of edges decides nothing.
constexpr double radius_slack = 1 + 1e-12;

}  // namespace geocage::topology
