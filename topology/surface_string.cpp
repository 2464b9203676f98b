#include "topology/surface_string.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace geocage::topology {

using geometry::TriangleMesh;

namespace {

/// At most this many rounds of sliding and passing over vertices, and sweeps of sliding a round.
constexpr int most_rounds = 500, most_stale_rounds = 5, most_sweeps = 400;
/// Over-relaxation of a sweep: strings are chains, where plain sweeps take n^2 of them.
constexpr double over_relaxation = 1.7;
/// A crossing this near to an end of its edge, as a share of it, sits on the vertex: sliding ends there
/// slowly.
constexpr double at_vertex = 1e-4;

int corner_of(const TriangleMesh& mesh, int face, int vertex) {
  const auto& t = mesh.triangles[face];
  return t[0] == vertex ? 0 : t[1] == vertex ? 1 : 2;
}

double angle_rad(const Vec3& a, const Vec3& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

/// One string under work.
class Puller {
 public:
  Puller(const TriangleMesh& mesh, const NumberedEdges& edges, std::vector<Crossing> string)
      : mesh_(mesh), edges_(edges), string_(std::move(string)) {}

  /// The shortest string of all rounds, so that the length never grows.
  std::vector<Crossing> pull() {
    std::vector<Crossing> best;
    double least = std::numeric_limits<double>::infinity();
    for (int round = 0, stale = 0; round < most_rounds && stale < most_stale_rounds; ++round) {
      cancel_turns_back();
      if (string_.size() < 3) return {};
      const bool at_rest = slide();
      const double now = length();
      if (now < 1e-3 * (corner(string_[0], 1) - corner(string_[0], 0)).norm()) return {};
      stale = now < least * (1 - 1e-12) ? 0 : stale + 1;
      if (now < least) {
        least = now;
        best = string_;
      }
      if (!pass_over_vertices() && at_rest) break;
    }
    return best;
  }

 private:
  int size() const { return static_cast<int>(string_.size()); }
  const Crossing& at(int k) const { return string_[(k % size() + size()) % size()]; }
  const Vec3& corner(const Crossing& c, int end) const {
    return mesh_.vertices[mesh_.triangles[c.face][(c.side + end) % 3]];
  }
  Vec3 point(const Crossing& c) const { return (1 - c.t) * corner(c, 0) + c.t * corner(c, 1); }
  double length() const {
    double sum = 0;
    for (int k = 0; k < size(); ++k) sum += (point(at(k)) - point(at(k + 1))).norm();
    return sum;
  }

  /// A string that leaves through an edge and comes back through it at once need not go there.
  void cancel_turns_back() {
    std::vector<Crossing> kept;
    for (const Crossing& c : string_)
      if (!kept.empty() && edge(kept.back()) == edge(c))
        kept.pop_back();
      else
        kept.push_back(c);
    std::size_t from = 0;
    while (kept.size() - from >= 2 && edge(kept[from]) == edge(kept.back())) {
      ++from;
      kept.pop_back();
    }
    string_.assign(kept.begin() + static_cast<std::ptrdiff_t>(from), kept.end());
  }
  int edge(const Crossing& c) const { return edges_.of[c.face][c.side]; }

  /// The share of the edge at which the way from one point to another over it is shortest: the triangles on
  /// both sides turned into one plane.
  double best_share(const Crossing& c, const Vec3& before, const Vec3& after) const {
    const Vec3 from = corner(c, 0), along = corner(c, 1) - from;
    const double length2 = along.squaredNorm();
    const double t1 = (before - from).dot(along) / length2, t2 = (after - from).dot(along) / length2;
    const double h1 = (before - from - t1 * along).norm(), h2 = (after - from - t2 * along).norm();
    if (h1 + h2 == 0) return std::clamp(c.t, std::min(t1, t2), std::max(t1, t2));
    return (t1 * h2 + t2 * h1) / (h1 + h2);
  }

  /// True when crossings came to rest.
  bool slide() {
    for (int sweep = 0; sweep < most_sweeps; ++sweep) {
      const double stretch = sweep + 20 < most_sweeps ? over_relaxation : 1;
      double moved = 0;
      for (int k = 0; k < size(); ++k) {
        Crossing& c = string_[k];
        const double wanted = best_share(c, point(at(k - 1)), point(at(k + 1)));
        const double t = std::clamp(c.t + stretch * (wanted - c.t), 0.0, 1.0);
        moved = std::max(moved, std::abs(t - c.t));
        c.t = t;
      }
      if (moved < 1e-10) return true;
    }
    return false;
  }

  /// The vertex that a crossing sits on, or -1.
  int vertex_at(const Crossing& c) const {
    if (c.t > at_vertex && c.t < 1 - at_vertex) return -1;
    return mesh_.triangles[c.face][(c.side + (c.t > 0.5)) % 3];
  }

  /// Passes the string over vertices that it bends around on the wrong side; false if there are none.
  bool pass_over_vertices() {
    int start = 0;  // begins a run: the crossing before it sits elsewhere
    while (start < size() && vertex_at(at(start)) >= 0 && vertex_at(at(start)) == vertex_at(at(start - 1)))
      ++start;
    if (start == size()) {
      string_.clear();  // all of it sits on one vertex
      return true;
    }
    std::vector<Crossing> passed;
    bool any = false, fresh = false;
    for (int from = start, to; from < start + size(); from = to) {
      const int v = vertex_at(at(from));
      to = from + 1;
      while (v >= 0 && to < start + size() && vertex_at(at(to)) == v) ++to;
      std::vector<Crossing> way(to - from);
      for (int k = from; k < to; ++k) way[k - from] = at(k);
      fresh =
          v >= 0 && !fresh && straighten(v, at(from - 1), at(to), way);  // every other one: neighbours move
      any |= fresh;
      passed.insert(passed.end(), way.begin(), way.end());
    }
    if (any) string_ = std::move(passed);
    return any;
  }

  double face_angle(int face, int v) const {
    const int c = corner_of(mesh_, face, v);
    const auto& t = mesh_.triangles[face];
    const Vec3& p = mesh_.vertices[v];
    return angle_rad(mesh_.vertices[t[(c + 1) % 3]] - p, mesh_.vertices[t[(c + 2) % 3]] - p);
  }
  Vec3 far_end(const Crossing& c, int v) const {
    return mesh_.triangles[c.face][c.side] == v ? corner(c, 1) : corner(c, 0);
  }

  /// `way` sits on v: leads it past v on the side where the angle is less, if that is less than pi. Sliding
  /// can't do that: no crossing alone leaves the vertex without a longer way.
  bool straighten(int v, const Crossing& before, const Crossing& after, std::vector<Crossing>& way) const {
    auto other = other_side(v, way);
    const double this_rad = angles(v, before, after, way).back(),
                 other_rad = angles(v, before, after, other).back();
    if (std::min(this_rad, other_rad) > M_PI - 1e-6) return false;
    if (other_rad < this_rad) way = std::move(other);
    const auto phi = angles(v, before, after, way);
    const Vec3& p = mesh_.vertices[v];
    const double a = (point(before) - p).norm(), b = (point(after) - p).norm(), all = phi.back();
    for (std::size_t k = 0; k < way.size(); ++k) {  // where the chord meets the edges, all in one plane
      const double away = a * b * std::sin(all) / (a * std::sin(phi[k]) + b * std::sin(all - phi[k]));
      const double t = std::min(1.0, away / (far_end(way[k], v) - p).norm());
      way[k].t = mesh_.triangles[way[k].face][way[k].side] == v ? t : 1 - t;
    }
    return true;
  }

  /// Angles at v from the crossing before to each edge of the way, and to the crossing after it.
  std::vector<double> angles(int v, const Crossing& before, const Crossing& after,
                             const std::vector<Crossing>& way) const {
    const Vec3& p = mesh_.vertices[v];
    if (way.empty()) return {angle_rad(point(before) - p, point(after) - p)};
    std::vector<double> phi = {angle_rad(point(before) - p, far_end(way[0], v) - p)};
    for (std::size_t k = 1; k < way.size(); ++k) phi.push_back(phi.back() + face_angle(way[k].face, v));
    phi.push_back(phi.back() + angle_rad(far_end(way.back(), v) - p, point(after) - p));
    return phi;
  }

  /// The way round v the other way, from the face before to the face behind.
  std::vector<Crossing> other_side(int v, const std::vector<Crossing>& way) const {
    const bool clockwise = mesh_.triangles[way[0].face][way[0].side] == v;
    const int last = edges_.across[way.back().face][way.back().side];
    std::vector<Crossing> other;
    for (int face = way[0].face; face != last; face = edges_.across[face][other.back().side]) {
      const int c = corner_of(mesh_, face, v);
      other.push_back({face, clockwise ? (c + 2) % 3 : c, clockwise ? 1.0 : 0.0});
    }
    return other;
  }

  const TriangleMesh& mesh_;
  const NumberedEdges& edges_;
  std::vector<Crossing> string_;
};

}  // namespace

std::vector<Crossing> string_along(const TriangleMesh& mesh, const NumberedEdges& edges,
                                   const std::vector<int>& walk) {
  const auto triangles = geometry::vertex_triangles(mesh);
  const auto left_face = [&](int from, int to) {
    for (int i = triangles.start[from]; i < triangles.start[from + 1]; ++i) {
      const int f = triangles.items[i];
      if (mesh.triangles[f][(corner_of(mesh, f, from) + 1) % 3] == to) return f;
    }
    return -1;
  };
  std::vector<Crossing> string;
  for (std::size_t i = 0; i < walk.size(); ++i) {
    const int v = walk[i], next = walk[(i + 1) % walk.size()];
    const int before = walk[(i + walk.size() - 1) % walk.size()];
    // On the left of the walk one goes round a vertex clockwise.
    for (int face = left_face(before, v);;) {
      const int c = corner_of(mesh, face, v);
      if (mesh.triangles[face][(c + 1) % 3] == next) break;
      string.push_back({face, c, 0});
      face = edges.across[face][c];
    }
  }
  return string;
}

std::vector<Crossing> pull_tight(const TriangleMesh& mesh, const NumberedEdges& edges,
                                 std::vector<Crossing> string) {
  return Puller(mesh, edges, std::move(string)).pull();
}

SurfaceLoop loop_of(const TriangleMesh& mesh, const std::vector<Crossing>& string) {
  SurfaceLoop loop;
  for (const Crossing& c : string) {
    loop.strip.push_back(c.face);
    const auto& t = mesh.triangles[c.face];
    const Vec3 p = (1 - c.t) * mesh.vertices[t[c.side]] + c.t * mesh.vertices[t[(c.side + 1) % 3]];
    if (loop.path.empty() || p != loop.path.back()) loop.path.push_back(p);  // a vertex is named once
  }
  while (loop.path.size() > 1 && loop.path.front() == loop.path.back()) loop.path.pop_back();
  for (std::size_t i = 0; i < loop.path.size(); ++i)
    loop.length_m += (loop.path[(i + 1) % loop.path.size()] - loop.path[i]).norm();
  return loop;
}

}  // namespace geocage::topology
