#include "topology/plain_balls.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <queue>
#include <set>

#include <Eigen/Eigenvalues>
#include <omp.h>

#include "topology/section.h"

namespace geocage::topology {

using geometry::CompressedRows;
using geometry::TriangleMesh;

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

}  // namespace

void PlainSearch::run(int source, double radius_m, Metric metric) {
  for (int v : order_) rank_[v] = outside;
  order_.clear();
  distance_m_.clear();
  if (metric == Metric::hop)
    breadth_first(source, radius_m);
  else
    dijkstra(source, radius_m);
}

int PlainSearch::count_within(double radius_m) const {
  return static_cast<int>(std::upper_bound(distance_m_.begin(), distance_m_.end(), radius_m * radius_slack) -
                          distance_m_.begin());
}

void PlainSearch::take(int v, double distance_m) {
  rank_[v] = static_cast<int>(order_.size());
  order_.push_back(v);
  distance_m_.push_back(distance_m);
}

void PlainSearch::breadth_first(int source, double radius_m) {
  take(source, 0);
  for (std::size_t head = 0; head < order_.size(); ++head) {
    const double next = distance_m_[head] + mean_edge_m_;
    if (next > radius_m * radius_slack) break;
    const int v = order_[head];
    for (int i = neighbours_.start[v]; i < neighbours_.start[v + 1]; ++i)
      if (rank_[neighbours_.items[i]] == outside) take(neighbours_.items[i], next);
  }
}

void PlainSearch::dijkstra(int source, double radius_m) {
  using Entry = std::pair<double, int>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
  queue.emplace(0.0, source);
  while (!queue.empty()) {
    const auto [d, v] = queue.top();
    queue.pop();
    if (rank_[v] != outside) continue;
    take(v, d);
    for (int i = neighbours_.start[v]; i < neighbours_.start[v + 1]; ++i) {
      const int w = neighbours_.items[i];
      const double next = d + (mesh_.vertices[v] - mesh_.vertices[w]).norm();
      if (rank_[w] == outside && next <= radius_m * radius_slack) queue.emplace(next, w);
    }
  }
}

namespace {

/// Fills the fields of vertex `source` from the first `count` vertices of the search.
class Measurer {
 public:
  Measurer(const Surface& surface, const PlainSearch& search, const BallOptions& options)
      : surface_(surface), search_(search), options_(options), cutter_(surface.mesh, surface.edges) {}

  void measure(int source, int count, BallFields& out) {
    sum_vertices(source, count, out);
    collect_triangles(source, count, out);
    const bool dominant = principal_axis(source, count, out);
    section_ = {};
    if (dominant && options_.winding) section_ = cut(source, out.center[source], out.axis[source]);
    out.winding_angle_rad[source] = winding_angle_rad(section_, out.center[source], out.axis[source]);
    out.accumulated_angle_rad[source] = accumulated_angle_rad(section_, out.center[source], out.axis[source]);
  }

  /// Of the ball that was measured last.
  const std::vector<int>& triangles() const { return inside_; }
  const Section& section() const { return section_; }

 private:
  Section cut(int source, const Vec3& center, const Vec3& axis) {
    const Section section = cutter_.cut(inside_, surface_.mesh.vertices[source], center, axis);
    return options_.section == SectionPath::plane ? section
                                                  : along_edges(section, surface_.mesh, center, axis);
  }

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
    const bool dominant = values[2] > 0 && values[2] >= options_.eigenvalue_ratio_guard * values[1];
    out.axis[source] = dominant ? directed(solver.eigenvectors().col(2)) : Vec3::Zero();
    return dominant;
  }

  const Surface& surface_;
  const PlainSearch& search_;
  const BallOptions options_;
  std::vector<int> inside_;
  Section section_;
  Cutter cutter_;
};

/// Closed walks along the border of a set of triangles, keeping to one fan at each vertex.
int count_boundary_loops(const NumberedEdges& edges, const std::vector<int>& triangles) {
  const auto inside = [&](int f) {
    return f >= 0 && std::binary_search(triangles.begin(), triangles.end(), f);
  };
  std::set<std::pair<int, int>> left;  // border sides: triangle, side
  for (int f : triangles)
    for (int i = 0; i < 3; ++i)
      if (!inside(edges.across[f][i])) left.emplace(f, i);
  int loops = 0;
  while (!left.empty()) {
    ++loops;
    for (auto side = *left.begin(); left.erase(side) > 0;) {
      auto [f, i] = side;
      i = (i + 1) % 3;
      while (inside(edges.across[f][i])) {
        const int g = edges.across[f][i];
        int k = 0;
        while (edges.of[g][k] != edges.of[f][i]) ++k;
        f = g;
        i = (k + 1) % 3;
      }
      side = {f, i};
    }
  }
  return loops;
}

}  // namespace

struct PlainBalls::Parts {
  const Surface surface;
  const Metric metric;
  const BallOptions options;
};

PlainBalls::PlainBalls(const TriangleMesh& mesh, Metric metric, const BallOptions& options)
    : parts_(new Parts{Surface(mesh), metric, options}) {}
PlainBalls::~PlainBalls() = default;

void PlainBalls::measure(const std::vector<int>& vertices, BallSet& set) {
  const Surface& surface = parts_->surface;
  const auto count = static_cast<int>(vertices.size());
  double largest = 0;
  for (const BallFields& fields : set.radii) largest = std::max(largest, fields.radius_m);
#pragma omp parallel
  {
    PlainSearch search(surface.mesh, surface.neighbours, surface.mean_edge);
    Measurer measurer(surface, search, parts_->options);
#pragma omp for schedule(dynamic, 16)
    for (int i = 0; i < count; ++i) {
      search.run(vertices[i], largest, parts_->metric);
      for (BallFields& fields : set.radii)
        measurer.measure(vertices[i], search.count_within(fields.radius_m), fields);
    }
  }
}

BallSet plain_ball_fields(const TriangleMesh& mesh, const std::vector<double>& radii_m, Metric metric,
                          const BallOptions& options) {
  BallSet set;
  for (double radius : radii_m) set.radii.push_back(BallFields::of_size(mesh.vertices.size(), radius));
  std::vector<int> all(mesh.vertices.size());
  std::iota(all.begin(), all.end(), 0);
  PlainBalls(mesh, metric, options).measure(all, set);
  return set;
}

Ball section_of_ball(const TriangleMesh& mesh, int vertex, double radius_m, Metric metric,
                     const BallOptions& options) {
  const Surface surface(mesh);
  PlainSearch search(mesh, surface.neighbours, surface.mean_edge);
  search.run(vertex, radius_m, metric);
  const int count = search.count_within(radius_m);
  Measurer measurer(surface, search, options);
  BallFields fields = BallFields::of_size(mesh.vertices.size(), radius_m);
  measurer.measure(vertex, count, fields);

  Ball ball;
  for (int i = 0; i < count; ++i) ball.vertices.push_back(search.vertex(i));
  ball.triangles = measurer.triangles();
  std::sort(ball.triangles.begin(), ball.triangles.end());
  ball.boundary_loops = count_boundary_loops(surface.edges, ball.triangles);
  ball.center = fields.center[vertex];
  ball.axis = fields.axis[vertex];
  ball.has_axis = ball.axis != Vec3::Zero();
  ball.section = measurer.section();
  ball.winding_angle_rad = fields.winding_angle_rad[vertex];
  ball.accumulated_angle_rad = fields.accumulated_angle_rad[vertex];
  return ball;
}

}  // namespace geocage::topology
