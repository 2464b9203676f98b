#include "topology/balls.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <queue>

#include <Eigen/Eigenvalues>
#include <omp.h>

#include "topology/section.h"

namespace geocage::topology {

using geometry::CompressedRows;
using geometry::TriangleMesh;

std::vector<double> angle_defects_rad(const TriangleMesh& mesh) {
  std::vector<double> defects(mesh.vertices.size(), 2 * M_PI);
  for (const auto& t : mesh.triangles)
    for (int i = 0; i < 3; ++i) {
      const Vec3 u = mesh.vertices[t[(i + 1) % 3]] - mesh.vertices[t[i]];
      const Vec3 v = mesh.vertices[t[(i + 2) % 3]] - mesh.vertices[t[i]];
      defects[t[i]] -= std::atan2(u.cross(v).norm(), u.dot(v));
    }
  return defects;
}

double median_share(const BallFields& ball, double surface_area_m2) {
  std::vector<double> areas = ball.ball_area_m2;
  const auto middle = areas.begin() + static_cast<std::ptrdiff_t>(areas.size() / 2);
  std::nth_element(areas.begin(), middle, areas.end());
  return *middle / surface_area_m2;
}

namespace {

/// What every ball of a mesh needs, computed once.
struct Surface {
  const TriangleMesh& mesh;
  CompressedRows neighbours, triangles;
  std::vector<double> defects, areas;
  NumberedEdges edges;
  double mean_edge;

  explicit Surface(const TriangleMesh& m)
      : mesh(m),
        neighbours(vertex_neighbours(m)),
        triangles(vertex_triangles(m)),
        defects(angle_defects_rad(m)),
        edges(m),
        mean_edge(mean_edge_m(m)) {
    for (const auto& t : m.triangles)
      areas.push_back(
          (m.vertices[t[1]] - m.vertices[t[0]]).cross(m.vertices[t[2]] - m.vertices[t[0]]).norm() / 2);
  }
};

/// One thread's desk: the vertices around one source in the order of their distance.
class Search {
 public:
  explicit Search(const Surface& surface) : surface_(surface), rank_(surface.mesh.vertices.size(), outside) {}

  void run(int source, double radius_m, Metric metric) {
    for (int v : order_) rank_[v] = outside;
    order_.clear();
    distance_.clear();
    if (metric == Metric::hop)
      breadth_first(source, radius_m);
    else
      dijkstra(source, radius_m);
  }

  /// How many vertices of the order lie within `radius_m`.
  int count_within(double radius_m) const {
    return static_cast<int>(std::upper_bound(distance_.begin(), distance_.end(), radius_m * (1 + 1e-12)) -
                            distance_.begin());
  }
  int vertex(int rank) const { return order_[rank]; }
  int rank(int vertex) const { return rank_[vertex]; }

 private:
  static constexpr int outside = std::numeric_limits<int>::max();

  void take(int v, double distance) {
    rank_[v] = static_cast<int>(order_.size());
    order_.push_back(v);
    distance_.push_back(distance);
  }

  void breadth_first(int source, double radius_m) {
    take(source, 0);
    const auto& n = surface_.neighbours;
    for (std::size_t head = 0; head < order_.size(); ++head) {
      const double next = distance_[head] + surface_.mean_edge;
      if (next > radius_m * (1 + 1e-12)) break;
      const int v = order_[head];
      for (int i = n.start[v]; i < n.start[v + 1]; ++i)
        if (rank_[n.items[i]] == outside) take(n.items[i], next);
    }
  }

  void dijkstra(int source, double radius_m) {
    using Entry = std::pair<double, int>;
    std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
    queue.emplace(0.0, source);
    const auto& n = surface_.neighbours;
    while (!queue.empty()) {
      const auto [d, v] = queue.top();
      queue.pop();
      if (rank_[v] != outside) continue;
      take(v, d);
      for (int i = n.start[v]; i < n.start[v + 1]; ++i) {
        const int w = n.items[i];
        const double next = d + (surface_.mesh.vertices[v] - surface_.mesh.vertices[w]).norm();
        if (rank_[w] == outside && next <= radius_m * (1 + 1e-12)) queue.emplace(next, w);
      }
    }
  }

  const Surface& surface_;
  std::vector<int> order_, rank_;
  std::vector<double> distance_;
};

/// Fills the fields of vertex `source` from the first `count` vertices of the search.
class Measurer {
 public:
  Measurer(const Surface& surface, const Search& search, double guard)
      : surface_(surface), search_(search), guard_(guard), cutter_(surface.mesh, surface.edges) {}

  void measure(int source, int count, BallFields& out) {
    sum_vertices(source, count, out);
    collect_triangles(source, count, out);
    const bool dominant = principal_axis(source, count, out);
    const Section section =
        dominant ? cutter_.cut(inside_, surface_.mesh.vertices[source], out.center[source], out.axis[source])
                 : Section{};
    out.winding_angle_rad[source] = winding_angle_rad(section, out.center[source], out.axis[source]);
  }

 private:
  void sum_vertices(int source, int count, BallFields& out) const {
    double curvature = 0;
    Vec3 sum = Vec3::Zero();
    for (int i = 0; i < count; ++i) {
      curvature += surface_.defects[search_.vertex(i)];
      sum += surface_.mesh.vertices[search_.vertex(i)];
    }
    out.curvature_sum_rad[source] = curvature;
    out.ball_vertices[source] = count;
    out.center[source] = sum / count;
  }

  /// Triangles with all corners in the ball; chi = V - E + F of these.
  void collect_triangles(int source, int count, BallFields& out) {
    inside_.clear();
    const auto& around = surface_.triangles;
    const auto in_ball = [&](int f) {
      const auto& t = surface_.mesh.triangles[f];
      return std::max({search_.rank(t[0]), search_.rank(t[1]), search_.rank(t[2])}) < count;
    };
    int used = 0, edges = 0;
    double area = 0;
    for (int i = 0; i < count; ++i) {
      const int v = search_.vertex(i);
      bool holds = false;
      for (int k = around.start[v]; k < around.start[v + 1]; ++k) {
        const int f = around.items[k];
        if (!in_ball(f)) continue;
        holds = true;
        if (surface_.mesh.triangles[f][0] != v) continue;  // each triangle once, at its first corner
        inside_.push_back(f);
        area += surface_.areas[f];
        for (int g : surface_.edges.across[f])
          edges += g < f || !in_ball(g);  // each edge once; a border has g = -1
      }
      used += holds;
    }
    out.ball_triangles[source] = static_cast<int>(inside_.size());
    out.euler[source] = used - edges + static_cast<int>(inside_.size());
    out.ball_area_m2[source] = area;
  }

  bool principal_axis(int source, int count, BallFields& out) const {
    Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
    for (int i = 0; i < count; ++i) {
      const Vec3 d = surface_.mesh.vertices[search_.vertex(i)] - out.center[source];
      scatter += d * d.transpose();
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(scatter);
    const Vec3 values = solver.eigenvalues();  // ascending
    const bool dominant = values[2] > 0 && values[2] >= guard_ * values[1];
    out.axis[source] = dominant ? Vec3(solver.eigenvectors().col(2)) : Vec3::Zero();
    return dominant;
  }

  const Surface& surface_;
  const Search& search_;
  const double guard_;
  std::vector<int> inside_;
  Cutter cutter_;
};

BallFields empty_fields(double radius_m, std::size_t n) {
  BallFields fields;
  fields.radius_m = radius_m;
  fields.curvature_sum_rad.resize(n);
  fields.winding_angle_rad.resize(n);
  fields.ball_vertices.resize(n);
  fields.ball_triangles.resize(n);
  fields.euler.resize(n);
  fields.ball_area_m2.resize(n);
  fields.center.resize(n);
  fields.axis.resize(n);
  return fields;
}

}  // namespace

BallSet ball_fields(const TriangleMesh& mesh, const std::vector<double>& radii_m, Metric metric,
                    double eigenvalue_ratio_guard) {
  const Surface surface(mesh);
  const auto count = static_cast<int>(mesh.vertices.size());
  BallSet set;
  for (double radius : radii_m) set.radii.push_back(empty_fields(radius, mesh.vertices.size()));
  const double largest = *std::max_element(radii_m.begin(), radii_m.end());
#pragma omp parallel
  {
    Search search(surface);
    Measurer measurer(surface, search, eigenvalue_ratio_guard);
#pragma omp for schedule(dynamic, 16)
    for (int v = 0; v < count; ++v) {
      search.run(v, largest, metric);
      for (BallFields& fields : set.radii) measurer.measure(v, search.count_within(fields.radius_m), fields);
    }
  }
  return set;
}

}  // namespace geocage::topology
