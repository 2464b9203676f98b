#include "topology/section.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

namespace geocage::topology {

namespace {

/// Where the plane cuts an edge of the mesh, and the (one or two) cut points it is joined to.
struct CutPoint {
  std::pair<int, int> edge;
  Vec3 p;
  std::array<int, 2> next = {-1, -1};
  void join(int other) { next[next[0] >= 0] = other; }
};

double distance_to_segment(const Vec3& p, const Vec3& a, const Vec3& b) {
  const Vec3 ab = b - a;
  const double length2 = ab.squaredNorm();
  const double t = length2 > 0 ? std::clamp((p - a).dot(ab) / length2, 0.0, 1.0) : 0;
  return (a + t * ab - p).norm();
}

/// The cut's points; every cut triangle joins two of them.
std::vector<CutPoint> cut_points(const geometry::TriangleMesh& mesh, const std::vector<int>& triangles,
                                 const Vec3& center, const Vec3& axis) {
  std::vector<CutPoint> points;
  std::map<std::pair<int, int>, int> known;
  const auto height = [&](int v) { return axis.dot(mesh.vertices[v] - center); };
  for (int f : triangles) {
    const auto& t = mesh.triangles[f];
    const std::array<double, 3> h = {height(t[0]), height(t[1]), height(t[2])};
    std::array<int, 2> ends;
    int found = 0;
    for (int i = 0; i < 3; ++i) {
      const int j = (i + 1) % 3;
      if ((h[i] >= 0) == (h[j] >= 0)) continue;
      const std::pair<int, int> edge = std::minmax(t[i], t[j]);
      const auto [it, fresh] = known.try_emplace(edge, static_cast<int>(points.size()));
      if (fresh)
        points.push_back({edge, (h[i] * mesh.vertices[t[j]] - h[j] * mesh.vertices[t[i]]) / (h[i] - h[j])});
      ends[found++] = it->second;
    }
    if (found != 2) continue;
    points[ends[0]].join(ends[1]);
    points[ends[1]].join(ends[0]);
  }
  return points;
}

/// The piece that holds `from`, which is one of its ends if it has ends; marks its points as taken.
Section walk(const std::vector<CutPoint>& points, int from, std::vector<char>& taken) {
  Section section;
  int before = -1, at = from;
  while (at >= 0 && !taken[at]) {
    taken[at] = 1;
    section.path.push_back(points[at].p);
    const auto& next = points[at].next;
    const int onward = next[0] != before ? next[0] : next[1];
    before = at;
    at = onward;
  }
  section.closed = at == from && section.path.size() > 2;
  return section;
}

double distance_to(const Section& section, const Vec3& p) {
  const auto& path = section.path;
  double best = (path.front() - p).norm();
  for (std::size_t i = 0; i + 1 < path.size(); ++i)
    best = std::min(best, distance_to_segment(p, path[i], path[i + 1]));
  if (section.closed) best = std::min(best, distance_to_segment(p, path.back(), path.front()));
  return best;
}

}  // namespace

Section cut(const geometry::TriangleMesh& mesh, const std::vector<int>& triangles, const Vec3& p,
            const Vec3& center, const Vec3& axis) {
  const auto points = cut_points(mesh, triangles, center, axis);
  std::vector<char> taken(points.size(), 0);
  Section nearest;
  double least = std::numeric_limits<double>::infinity();
  const auto consider = [&](int from) {
    if (taken[from]) return;
    Section section = walk(points, from, taken);
    const double d = distance_to(section, p);
    if (d >= least) return;
    least = d;
    nearest = std::move(section);
  };
  const int count = static_cast<int>(points.size());
  for (int i = 0; i < count; ++i)
    if (points[i].next[1] < 0) consider(i);  // ends of open pieces first
  for (int i = 0; i < count; ++i) consider(i);
  return nearest;
}

double winding_angle_rad(const Section& section, const Vec3& center, const Vec3& axis) {
  if (section.path.empty()) return std::numeric_limits<double>::quiet_NaN();
  if (section.closed) return 2 * M_PI;
  double angle = 0;
  for (std::size_t i = 0; i + 1 < section.path.size(); ++i) {
    const Vec3 a = section.path[i] - center, b = section.path[i + 1] - center;
    angle += std::atan2(axis.dot(a.cross(b)), a.dot(b));
  }
  return std::clamp(std::abs(angle), M_PI, 2 * M_PI);
}

}  // namespace geocage::topology
