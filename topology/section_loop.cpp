#include <algorithm>
#include <limits>

#include "topology/loops.h"
#include "topology/surface_string.h"

namespace geocage::topology {

using geometry::TriangleMesh;

namespace {

/// Where a plane cuts a closed surface: every piece is a closed string. A vertex on the plane is above it.
class PlaneCut {
 public:
  PlaneCut(const TriangleMesh& mesh, const NumberedEdges& edges, const Vec3& center, const Vec3& axis)
      : mesh_(mesh), edges_(edges) {
    for (const Vec3& v : mesh.vertices) height_.push_back(axis.dot(v - center));
  }

  /// The piece that comes nearest to p; empty when there is none.
  std::vector<Crossing> nearest(const Vec3& p) const {
    std::vector<char> seen(mesh_.triangles.size(), 0);
    std::vector<Crossing> best;
    double least = std::numeric_limits<double>::infinity();
    for (int f = 0; f < static_cast<int>(mesh_.triangles.size()); ++f) {
      if (seen[f] || way_out(f) < 0) continue;
      auto piece = follow(f, seen);
      const double d = distance(loop_of(mesh_, piece).path, p);
      if (d >= least) continue;
      least = d;
      best = std::move(piece);
    }
    return best;
  }

 private:
  double height(int f, int corner) const { return height_[mesh_.triangles[f][corner % 3]]; }

  /// The side through which the cut leaves a triangle with what is above on its left, or -1.
  int way_out(int f) const {
    for (int i = 0; i < 3; ++i)
      if (height(f, i) < 0 && height(f, i + 1) >= 0) return i;
    return -1;
  }

  std::vector<Crossing> follow(int f, std::vector<char>& seen) const {
    std::vector<Crossing> string;
    while (!seen[f]) {
      seen[f] = 1;
      const int side = way_out(f);
      const double low = height(f, side), high = height(f, side + 1);
      string.push_back({f, side, low / (low - high)});
      f = edges_.across[f][side];
    }
    return string;
  }

  static double distance(const Polyline& loop, const Vec3& p) {
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < loop.size(); ++i) {
      const Vec3 a = loop[i], ab = loop[(i + 1) % loop.size()] - a;
      const double t = ab.squaredNorm() > 0 ? std::clamp((p - a).dot(ab) / ab.squaredNorm(), 0.0, 1.0) : 0;
      least = std::min(least, (a + t * ab - p).norm());
    }
    return least;
  }

  const TriangleMesh& mesh_;
  const NumberedEdges& edges_;
  std::vector<double> height_;
};

}  // namespace

std::optional<SurfaceLoop> section_loop(const TriangleMesh& mesh, const NumberedEdges& edges, const Vec3& p,
                                        const Vec3& center, const Vec3& axis) {
  const auto string = PlaneCut(mesh, edges, center, axis).nearest(p);
  if (string.empty()) return std::nullopt;
  return loop_of(mesh, string);
}

std::optional<SurfaceLoop> neck_loop(const TriangleMesh& mesh, const NumberedEdges& edges, const Vec3& p,
                                     const Vec3& center, const Vec3& axis) {
  const auto string = pull_tight(mesh, edges, PlaneCut(mesh, edges, center, axis).nearest(p));
  if (string.empty()) return std::nullopt;
  return loop_of(mesh, string);
}

}  // namespace geocage::topology
