#include "topology/surface_string.h"

#include <algorithm>
#include <cmath>

namespace geocage::topology {

using geometry::TriangleMesh;

namespace {

/// At most this many rounds of sliding and passing over vertices, and sweeps of sliding a round.
constexpr int most_rounds = 200, most_sweeps = 400;
/// Over-relaxation of a sweep: strings are chains, where plain sweeps take n^2 of them.
constexpr double over_relaxation = 1.7;

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

  std::vector<Crossing> pull() {
    for (int round = 0; round < most_rounds; ++round) {
      cancel_turns_back();
      if (string_.size() < 3) return {};
      slide();
      if (length() < 1e-3 * (corner(string_[0], 1) - corner(string_[0], 0)).norm()) return {};
      if (!pass_over_vertices()) break;
    }
    return string_;
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

  void slide() {
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
      if (moved < 1e-10) break;
    }
  }

  /// The vertex that a crossing sits on, or -1.
  int vertex_at(const Crossing& c) const {
    if (c.t > 1e-9 && c.t < 1 - 1e-9) return -1;
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
    bool any = false;
    for (int from = start, to; from < start + size(); from = to) {
      const int v = vertex_at(at(from));
      to = from + 1;
      while (v >= 0 && to < start + size() && vertex_at(at(to)) == v) ++to;
      if (v >= 0 && other_side_rad(v, from, to) < M_PI - 1e-7) {
        any = true;
        append_other_side(v, from, to, passed);
      } else {
        for (int k = from; k < to; ++k) passed.push_back(at(k));
      }
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

  /// The angle at v on the side that crossings from .. to - 1 don't go round.
  double other_side_rad(int v, int from, int to) const {
    const Vec3& p = mesh_.vertices[v];
    double this_side = angle_rad(point(at(from - 1)) - p, far_end(at(from), v) - p) +
                       angle_rad(far_end(at(to - 1), v) - p, point(at(to)) - p);
    for (int k = from + 1; k < to; ++k) this_side += face_angle(at(k).face, v);
    double all = 0;
    int face = at(from).face;
    do {
      all += face_angle(face, v);
      face = edges_.across[face][corner_of(mesh_, face, v)];
    } while (face != at(from).face);
    return all - this_side;
  }

  /// Goes round v the other way, from the face before the run to the face behind it.
  void append_other_side(int v, int from, int to, std::vector<Crossing>& passed) const {
    const bool clockwise = mesh_.triangles[at(from).face][at(from).side] == v;
    const int last = edges_.across[at(to - 1).face][at(to - 1).side];
    for (int face = at(from).face; face != last;) {
      const int c = corner_of(mesh_, face, v), side = clockwise ? (c + 2) % 3 : c;
      passed.push_back({face, side, clockwise ? 1.0 : 0.0});
      face = edges_.across[face][side];
    }
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
