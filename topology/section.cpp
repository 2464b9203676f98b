#include "topology/section.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

namespace geocage::topology {

namespace {

double distance_to_segment(const Vec3& p, const Vec3& a, const Vec3& b) {
  const Vec3 ab = b - a;
  const double length2 = ab.squaredNorm();
  const double t = length2 > 0 ? std::clamp((p - a).dot(ab) / length2, 0.0, 1.0) : 0;
  return (a + t * ab - p).norm();
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

NumberedEdges::NumberedEdges(const geometry::TriangleMesh& mesh) {
  std::map<std::pair<int, int>, std::pair<int, int>> first;  // edge -> triangle and side that named it
  of.assign(mesh.triangles.size(), {-1, -1, -1});
  across = of;
  for (int f = 0; f < static_cast<int>(of.size()); ++f)
    for (int i = 0; i < 3; ++i) {
      const auto& t = mesh.triangles[f];
      const auto [it, fresh] = first.try_emplace(std::minmax(t[i], t[(i + 1) % 3]), f, i);
      if (fresh) {
        of[f][i] = count++;
        continue;
      }
      const auto [g, k] = it->second;
      of[f][i] = of[g][k];
      across[f][i] = g;
      across[g][k] = f;
    }
}

void Cutter::find_points(const std::vector<int>& triangles, const Vec3& center, const Vec3& axis) {
  for (const CutPoint& point : points_) known_[point.edge] = -1;
  points_.clear();
  const double offset = plane_offset(axis, center, mean_edge_m_);
  for (int f : triangles) {
    const auto& t = mesh_.triangles[f];
    std::array<double, 3> h;
    for (int i = 0; i < 3; ++i) h[i] = plane_height(axis.data(), offset, mesh_.vertices[t[i]].data());
    const int above = (h[0] >= 0) + (h[1] >= 0) + (h[2] >= 0);
    if (above == 0 || above == 3) continue;
    std::array<int, 2> ends;
    int found = 0;
    for (int i = 0; i < 3; ++i) {
      const int j = (i + 1) % 3;
      if ((h[i] >= 0) == (h[j] >= 0)) continue;
      int& known = known_[edges_.of[f][i]];
      if (known < 0) {
        known = static_cast<int>(points_.size());
        points_.push_back({edges_.of[f][i], h[i] >= 0 ? std::array{t[i], t[j]} : std::array{t[j], t[i]},
                           (h[i] * mesh_.vertices[t[j]] - h[j] * mesh_.vertices[t[i]]) / (h[i] - h[j])});
      }
      ends[found++] = known;
    }
    points_[ends[0]].join(ends[1]);
    points_[ends[1]].join(ends[0]);
  }
}

/// The piece that holds `from`, which is one of its ends if it has ends.
Section Cutter::walk(int from) {
  Section section;
  int before = -1, at = from;
  while (at >= 0 && !taken_[at]) {
    taken_[at] = 1;
    section.path.push_back(points_[at].p);
    section.edges.push_back(points_[at].ends);
    const auto& next = points_[at].next;
    const int onward = next[0] != before ? next[0] : next[1];
    before = at;
    at = onward;
  }
  section.closed = at == from && section.path.size() > 2;
  return section;
}

Section Cutter::cut(const std::vector<int>& triangles, const Vec3& p, const Vec3& center, const Vec3& axis) {
  find_points(triangles, center, axis);
  taken_.assign(points_.size(), 0);
  Section nearest;
  double least = std::numeric_limits<double>::infinity();
  const auto consider = [&](int from) {
    if (taken_[from]) return;
    Section section = walk(from);
    const double d = distance_to(section, p);
    if (d >= least) return;
    least = d;
    nearest = std::move(section);
  };
  const int count = static_cast<int>(points_.size());
  for (int i = 0; i < count; ++i)
    if (points_[i].next[1] < 0) consider(i);  // ends of open pieces first
  for (int i = 0; i < count; ++i) consider(i);
  return nearest;
}

Section along_edges(const Section& section, const geometry::TriangleMesh& mesh, const Vec3& center,
                    const Vec3& axis) {
  Section along;
  along.closed = section.closed;
  const double offset = plane_height(axis.data(), 0, center.data());
  int last = -1;
  for (const auto& [above, below] : section.edges) {
    const double up = plane_height(axis.data(), offset, mesh.vertices[above].data());
    const double down = plane_height(axis.data(), offset, mesh.vertices[below].data());
    const int v = up <= -down ? above : below;
    if (v == last) continue;
    last = v;
    along.path.push_back(mesh.vertices[v] - (v == above ? up : down) * axis);
    along.edges.push_back({v, v});
  }
  return along;
}

double accumulated_angle_rad(const Section& section, const Vec3& center, const Vec3& axis) {
  if (section.path.empty()) return std::numeric_limits<double>::quiet_NaN();
  double angle = 0;
  const auto add = [&](const Vec3& from, const Vec3& to) {
    const Vec3 a = from - center, b = to - center;
    angle += std::atan2(axis.dot(a.cross(b)), a.dot(b));
  };
  for (std::size_t i = 0; i + 1 < section.path.size(); ++i) add(section.path[i], section.path[i + 1]);
  if (section.closed) add(section.path.back(), section.path.front());
  return std::abs(angle);
}

double winding_angle_rad(const Section& section, const Vec3& center, const Vec3& axis) {
  if (section.closed) return 2 * M_PI;
  const double angle = accumulated_angle_rad(section, center, axis);
  return std::isnan(angle) ? angle : std::clamp(angle, M_PI, 2 * M_PI);
}

}  // namespace geocage::topology
