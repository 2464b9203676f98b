#include "geometry/crossings.h"

#include <algorithm>
#include <optional>

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Intersections_3/Segment_3_Triangle_3.h>
#include <CGAL/Intersections_3/Triangle_3_Triangle_3.h>
#include <CGAL/box_intersection_d.h>

namespace geocage::geometry {

namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Point = Kernel::Point_3;
using Box = CGAL::Box_intersection_d::Box_with_info_d<double, 3, int>;

class Triangles {
 public:
  explicit Triangles(const TriangleMesh& mesh) : mesh_(mesh) {
    points_.reserve(mesh.vertices.size());
    for (const Vec3& p : mesh.vertices) points_.emplace_back(p.x(), p.y(), p.z());
    line_.resize(mesh.triangles.size());
    for (std::size_t f = 0; f < line_.size(); ++f) {
      const auto& [a, b, c] = mesh.triangles[f];
      line_[f] = CGAL::collinear(points_[a], points_[b], points_[c]);
    }
  }

  bool on_a_line(int f) const { return line_[f]; }

  Box box(int f) const {
    CGAL::Bbox_3 box;
    for (int v : mesh_.triangles[f]) box += points_[v].bbox();
    return {box, f};
  }

  /// Whether two triangles meet beyond what they share.
  bool cross(int f, int g) const {
    if (line_[f] || line_[g]) return false;  // told by themselves
    const auto &t = mesh_.triangles[f], &u = mesh_.triangles[g];
    int shared = 0, at_f = 0, at_g = 0, sum_f = 0, sum_g = 0;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j)
        if (t[i] == u[j]) {
          ++shared;
          at_f = i;
          at_g = j;
          sum_f += i;
          sum_g += j;
        }
    if (shared == 3) return true;
    if (shared == 2) return folded(t, 3 - sum_f, u, 3 - sum_g);
    if (shared == 1)
      return CGAL::do_intersect(opposite(t, at_f), triangle(u)) ||
             CGAL::do_intersect(opposite(u, at_g), triangle(t));
    return CGAL::do_intersect(triangle(t), triangle(u));
  }

 private:
  using Corners = std::array<int, 3>;

  Kernel::Triangle_3 triangle(const Corners& t) const {
    return {points_[t[0]], points_[t[1]], points_[t[2]]};
  }
  Kernel::Segment_3 opposite(const Corners& t, int corner) const {
    return {points_[t[(corner + 1) % 3]], points_[t[(corner + 2) % 3]]};
  }
  /// Two triangles on one side overlap only when they lie in one plane with their third corners (`corner_t`,
  /// `corner_u`) on the same side of it.
  bool folded(const Corners& t, int corner_t, const Corners& u, int corner_u) const {
    const Point &a = points_[t[(corner_t + 1) % 3]], &b = points_[t[(corner_t + 2) % 3]];
    const Point &p = points_[t[corner_t]], &q = points_[u[corner_u]];
    return CGAL::coplanar(a, b, p, q) && CGAL::coplanar_orientation(a, b, p, q) == CGAL::POSITIVE;
  }

  const TriangleMesh& mesh_;
  std::vector<Point> points_;
  std::vector<char> line_;
};

struct Enough {};

}  // namespace

std::vector<std::pair<int, int>> crossing_triangles(const TriangleMesh& mesh, std::size_t most) {
  const Triangles triangles(mesh);
  std::vector<std::pair<int, int>> pairs;
  const auto add = [&](int f, int g) {
    pairs.emplace_back(std::min(f, g), std::max(f, g));
    if (pairs.size() >= most) throw Enough();
  };
  std::vector<Box> boxes;
  try {
    for (int f = 0; f < static_cast<int>(mesh.triangles.size()); ++f) {
      if (triangles.on_a_line(f)) add(f, f);
      boxes.push_back(triangles.box(f));
    }
    CGAL::box_self_intersection_d(boxes.begin(), boxes.end(), [&](const Box& a, const Box& b) {
      if (triangles.cross(a.info(), b.info())) add(a.info(), b.info());
    });
  } catch (const Enough&) {
  }
  std::sort(pairs.begin(), pairs.end());
  return pairs;
}

}  // namespace geocage::geometry
