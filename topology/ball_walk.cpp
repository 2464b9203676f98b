#include "topology/ball_walk.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <unordered_set>

#include "topology/section.h"

namespace geocage::topology {

using geometry::Vec3;

namespace {

constexpr std::size_t near_steps = 32;      // crossings that are kept on each side of a walk's start
constexpr double rounding = 1 + 1e-9;       // a piece as near as this is looked at again
constexpr double outermost = 0.5773502692;  // no point of a triangle is farther from its corners, per longest side

std::uint64_t crossing(int above, int below) {
  return static_cast<std::uint64_t>(above) << 32 | static_cast<std::uint32_t>(below);
}

double square(double x) {
  return x * x;
}

}  // namespace

VertexGrid::VertexGrid(const BallMesh& mesh) {
  double high[3];
  for (int i = 0; i < 3; ++i) low_[i] = high[i] = mesh.position(0)[i];
  for (int v = 0; v < mesh.count; ++v)
    for (int i = 0; i < 3; ++i) {
      low_[i] = std::min(low_[i], mesh.position(v)[i]);
      high[i] = std::max(high[i], mesh.position(v)[i]);
    }
  double side = std::max(2 * mesh.mean_edge_m, 1e-300);
  for (;; side *= 1.25) {
    double total = 1;
    for (int i = 0; i < 3; ++i) total *= std::floor((high[i] - low_[i]) / side) + 1;
    if (total > 4.0 * mesh.count) continue;
    for (int i = 0; i < 3; ++i) cells_[i] = static_cast<int>((high[i] - low_[i]) / side) + 1;
    break;
  }
  per_m_ = 1 / side;
  start_.assign(static_cast<std::size_t>(cells_[0]) * cells_[1] * cells_[2] + 1, 0);
  std::vector<int> cell_of(static_cast<std::size_t>(mesh.count));
  for (int v = 0; v < mesh.count; ++v) {
    const Vec3 p = mesh.position(v);
    cell_of[v] = (cell(2, p.z()) * cells_[1] + cell(1, p.y())) * cells_[0] + cell(0, p.x());
    ++start_[cell_of[v] + 1];
  }
  std::partial_sum(start_.begin(), start_.end(), start_.begin());
  items_.resize(static_cast<std::size_t>(mesh.count));
  std::vector<int> next(start_.begin(), start_.end() - 1);
  for (int v = 0; v < mesh.count; ++v) items_[next[cell_of[v]]++] = v;
}

void SectionWalker::set_plane(const Vec3& center, const Vec3& axis) {
  Vec3 u = axis.cross(Vec3::Unit(std::abs(axis.x()) < 0.6 ? 0 : 1));
  u /= std::sqrt(u.squaredNorm());
  const Vec3 v = axis.cross(u);
  for (int i = 0; i < 3; ++i) {
    plane_.axis[i] = axis[i];
    plane_.u[i] = u[i];
    plane_.v[i] = v[i];
    plane_.center[i] = center[i];
  }
  plane_.offset = plane_offset(axis, center);
}

inline SectionWalker::Place SectionWalker::place(int vertex) const {
  const double* p = &mesh_.points[vertex].x;
  const double x = p[0] - plane_.center[0], y = p[1] - plane_.center[1], z = p[2] - plane_.center[2];
  return {plane_height(plane_.axis, plane_.offset, p), plane_.u[0] * x + plane_.u[1] * y + plane_.u[2] * z,
          plane_.v[0] * x + plane_.v[1] * y + plane_.v[2] * z};
}

/// Whether the plane runs between two vertices.
bool SectionWalker::crosses(int a, int b) const {
  return (plane_height(plane_.axis, plane_.offset, &mesh_.points[a].x) >= 0) !=
         (plane_height(plane_.axis, plane_.offset, &mesh_.points[b].x) >= 0);
}

/// From the source to where the plane cuts an edge.
double SectionWalker::point_distance2(int a, int b) const {
  const double *p = &mesh_.points[a].x, *q = &mesh_.points[b].x;
  const double h = plane_height(plane_.axis, plane_.offset, p), g = plane_height(plane_.axis, plane_.offset, q);
  const double s = 1 / (h - g);
  double sum = 0;
  for (int i = 0; i < 3; ++i) sum += square((h * q[i] - g * p[i]) * s - source_[i]);
  return sum;
}

/// From the source to the piece of the plane in the triangle a b c, where the plane crosses the edge a b.
double SectionWalker::segment_distance2(int a, int b, int c) const {
  const auto cut = [&](int from, int to) {
    const Vec3 p = mesh_.position(from), q = mesh_.position(to);
    const double h = plane_height(plane_.axis, plane_.offset, p.data());
    const double g = plane_height(plane_.axis, plane_.offset, q.data());
    return Vec3((h * q - g * p) / (h - g));
  };
  const Vec3 first = cut(a, b), second = crosses(a, c) ? cut(a, c) : cut(b, c);
  const Vec3 along = second - first, to = Vec3(source_[0], source_[1], source_[2]) - first;
  const double length2 = along.squaredNorm();
  const double t = length2 > 0 ? std::clamp(to.dot(along) / length2, 0.0, 1.0) : 0;
  return (t * along - to).squaredNorm();
}

/// From the source step by step to a neighbour nearer to the plane, until an edge of a triangle of the ball crosses
/// it; that edge as a half-edge, or -1 where there is no way down.
int SectionWalker::first_crossing(const LaneBall& ball, int source) const {
  int at = source;
  double height = plane_height(plane_.axis, plane_.offset, &mesh_.points[at].x);
  for (;;) {
    int found = -1, lower = -1;
    double least = std::numeric_limits<double>::infinity(), low = std::abs(height);
    for (int i = mesh_.link_start[at]; i < mesh_.link_start[at + 1]; ++i) {
      const Link& link = mesh_.links[i];
      if (!ball.has(link.neighbour)) continue;
      const double other = plane_height(plane_.axis, plane_.offset, &mesh_.points[link.neighbour].x);
      if ((other >= 0) != (height >= 0)) {
        if (link.half_edge < 0) continue;
        const int twin = mesh_.twin(link.half_edge);
        if (!ball.has(mesh_.half_edges[link.half_edge].opposite) &&
            (twin < 0 || !ball.has(mesh_.half_edges[twin].opposite)))
          continue;
        const double d = point_distance2(at, link.neighbour);
        if (d >= least) continue;
        least = d;
        found = link.half_edge;
      } else if (std::abs(other) < low) {
        low = std::abs(other);
        lower = link.neighbour;
      }
    }
    if (found >= 0 || lower < 0) return found;
    at = lower;
    height = height >= 0 ? low : -low;
  }
}

SectionWalker::Tip SectionWalker::tip_at(int half_edge) const {
  const int from = mesh_.half_edges[half_edge].from;
  const int to = mesh_.half_edges[half_edge % 3 == 2 ? half_edge - 2 : half_edge + 1].from;
  Tip tip{half_edge, from, to, true, place(from), place(to), 0, 0};
  if (tip.up.height < 0) {
    std::swap(tip.above, tip.below);
    std::swap(tip.up, tip.down);
    tip.from_above = false;
  }
  tip.qu = tip.up.height * tip.down.u - tip.down.height * tip.up.u;
  tip.qv = tip.up.height * tip.down.v - tip.down.height * tip.up.v;
  return tip;
}

/// Through the next triangle; false where that is not in the ball.
inline bool SectionWalker::advance(const LaneBall& ball, Tip& tip) const {
  if (tip.half_edge < 0) return false;
  const BallMesh::HalfEdge& h = mesh_.half_edges[tip.half_edge];
  if (!ball.has(h.opposite)) return false;
  const Place at = place(h.opposite);
  const bool above = at.height >= 0;
  if (above) {
    tip.above = h.opposite;
    tip.up = at;
  } else {
    tip.below = h.opposite;
    tip.down = at;
  }
  tip.half_edge = above == tip.from_above ? h.next : h.before;
  const double u = tip.up.height * tip.down.u - tip.down.height * tip.up.u;
  const double v = tip.up.height * tip.down.v - tip.down.height * tip.up.v;
  if ((v >= 0) != (tip.qv >= 0)) {
    const double cross = tip.qu * v - u * tip.qv;
    if (v < 0 && cross > 0) ++tip.turns;
    if (v >= 0 && cross < 0) --tip.turns;
  }
  tip.qu = u;
  tip.qv = v;
  return true;
}

/// To the end of the piece, or round to `home`. Notes the crossings near the start (`all`: every one), and how near
/// they come to the source.
void SectionWalker::walk(const LaneBall& ball, Tip& tip, int home, double& nearest2, bool all) {
  const std::size_t noted = near_.size() + near_steps;
  bool approaching = true;
  double last2 = point_distance2(tip.above, tip.below);
  nearest2 = std::min(nearest2, last2);
  int before_above = tip.above, before_below = tip.below;
  while (advance(ball, tip)) {
    if (all || near_.size() < noted) near_.push_back(crossing(tip.above, tip.below));
    if (all) {
      const int third = tip.above != before_above ? tip.above : tip.below;
      nearest2 = std::min(nearest2, segment_distance2(before_above, before_below, third));
      before_above = tip.above;
      before_below = tip.below;
    } else if (approaching) {
      const double now2 = point_distance2(tip.above, tip.below);
      nearest2 = std::min(nearest2, now2);
      approaching = now2 < last2;
      last2 = now2;
    }
    if (tip.half_edge == home) {
      tip.closed = true;
      return;
    }
  }
}

CutAngles SectionWalker::angles_from(const LaneBall& ball, int half_edge, double& nearest2, bool all) {
  near_.clear();
  Tip ahead = tip_at(half_edge);
  near_.push_back(crossing(ahead.above, ahead.below));
  Tip behind = ahead;
  walk(ball, ahead, half_edge, nearest2, all);
  if (ahead.closed) return {2 * M_PI, std::abs(2 * M_PI * ahead.turns)};
  behind.half_edge = mesh_.twin(half_edge);
  behind.from_above = !behind.from_above;
  walk(ball, behind, -2, nearest2, all);
  const double angle = std::abs(std::atan2(ahead.qv + 0.0, ahead.qu) - std::atan2(behind.qv + 0.0, behind.qu) +
                                2 * M_PI * (ahead.turns - behind.turns));
  return {std::clamp(angle, M_PI, 2 * M_PI), angle};
}

/// Whether no other piece of the section comes as near to the source as the walk that was just made. Every triangle
/// that could hold such a piece has a corner within `outermost` times the longest edge of the disc in which the plane
/// cuts the sphere of that radius around the source.
bool SectionWalker::is_nearest(const LaneBall& ball, double nearest2) const {
  const double bound2 = nearest2 * rounding;
  const double height = plane_height(plane_.axis, plane_.offset, source_);
  const double foot[3] = {source_[0] - height * plane_.axis[0], source_[1] - height * plane_.axis[1],
                          source_[2] - height * plane_.axis[2]};
  const double reach = mesh_.longest_edge_m * outermost * rounding;
  const double radius = std::sqrt(std::max(0.0, bound2 - height * height)) + reach;
  const auto other_piece = [&](int v) {
    const int first = mesh_.link_start[v], last = mesh_.link_start[v + 1];
    for (int i = first; i < last; ++i) {
      const int w = mesh_.links[i].neighbour;
      if (!ball.has(w) || !crosses(v, w)) continue;
      const bool up = plane_height(plane_.axis, plane_.offset, &mesh_.points[v].x) >= 0;
      const Crossing key = up ? crossing(v, w) : crossing(w, v);
      if (std::find(near_.begin(), near_.end(), key) != near_.end()) continue;
      for (int j : {i + 1 < last ? i + 1 : first, i > first ? i - 1 : last - 1}) {
        const int third = mesh_.links[j].neighbour;
        if (ball.has(third) && segment_distance2(v, w, third) <= bound2) return true;
      }
    }
    return false;
  };
  return grid_.around(foot, radius, [&](int v) {
    const double* p = &mesh_.points[v].x;
    if (square(p[0] - foot[0]) + square(p[1] - foot[1]) + square(p[2] - foot[2]) > radius * radius) return true;
    if (std::abs(plane_height(plane_.axis, plane_.offset, p)) > mesh_.longest_edge_m) return true;
    return !ball.has(v) || !other_piece(v);
  });
}

/// All pieces one after the other; the nearest one counts.
CutAngles SectionWalker::search_whole(const LaneBall& ball, int source) {
  ++searched_whole;
  CutAngles best{std::nan(""), std::nan("")};
  double least = std::numeric_limits<double>::infinity();
  std::unordered_set<Crossing> walked;
  std::unordered_set<int> seen{source};
  std::vector<int> queue{source};
  for (std::size_t head = 0; head < queue.size(); ++head) {
    const int v = queue[head];
    for (int i = mesh_.link_start[v]; i < mesh_.link_start[v + 1]; ++i) {
      const Link& link = mesh_.links[i];
      if (!ball.has(link.neighbour)) continue;
      if (seen.insert(link.neighbour).second) queue.push_back(link.neighbour);
      if (link.half_edge < 0 || !crosses(v, link.neighbour)) continue;
      const int twin = mesh_.twin(link.half_edge);
      if (!ball.has(mesh_.half_edges[link.half_edge].opposite) &&
          (twin < 0 || !ball.has(mesh_.half_edges[twin].opposite)))
        continue;
      if (walked.count(crossing(v, link.neighbour)) || walked.count(crossing(link.neighbour, v))) continue;
      double nearest2 = std::numeric_limits<double>::infinity();
      const CutAngles angles = angles_from(ball, link.half_edge, nearest2, true);
      walked.insert(near_.begin(), near_.end());
      if (nearest2 >= least) continue;
      least = nearest2;
      best = angles;
    }
  }
  return best;
}

CutAngles SectionWalker::measure(const LaneBall& ball, int source, const Vec3& center, const Vec3& axis) {
  set_plane(center, axis);
  for (int i = 0; i < 3; ++i) source_[i] = mesh_.position(source)[i];
  const int start = first_crossing(ball, source);
  if (start < 0) return search_whole(ball, source);
  double nearest2 = std::numeric_limits<double>::infinity();
  const CutAngles angles = angles_from(ball, start, nearest2, false);
  return is_nearest(ball, nearest2) ? angles : search_whole(ball, source);
}

}  // namespace geocage::topology
