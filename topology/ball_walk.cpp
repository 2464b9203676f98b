#include "topology/ball_walk.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <unordered_set>

#include "topology/section.h"

namespace geocage::topology {

using geometry::Vec3;

namespace {

constexpr double rounding = 1 + 1e-9;  // a piece as near as this is looked at again
constexpr double outermost =
    0.5773502692;  // no point of a triangle is farther from its corners, per longest side

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
  const auto room = static_cast<std::size_t>(mesh.count) + 16;
  items_.resize(room);
  reach_m_.resize(room);
  for (auto& coordinates : at_m_) coordinates.resize(room);
  std::vector<int> next(start_.begin(), start_.end() - 1);
  // Floats are off by 2^-24 of the extent at each end, and by a few roundings of what they add up to.
  const double extent = std::max({high[0] - low_[0], high[1] - low_[1], high[2] - low_[2]});
  for (int v = 0; v < mesh.count; ++v) {
    const int at = next[cell_of[v]]++;
    items_[at] = v;
    for (int i = 0; i < 3; ++i) at_m_[i][at] = static_cast<float>(mesh.position(v)[i] - low_[i]);
    const double reach = outermost * rounding * mesh.longest_m[v] + 1e-6 * extent;
    reach_m_[at] = static_cast<float>(reach * 1.00001);
    longest_reach_m_ = std::max(longest_reach_m_, reach);
  }
}

int VertexGrid::around(const double* p, double radius_m, int* found) const {
  int low[3], high[3];
  float at[3];
  for (int i = 0; i < 3; ++i) {
    low[i] = cell(i, p[i] - radius_m - longest_reach_m_);
    high[i] = cell(i, p[i] + radius_m + longest_reach_m_);
    at[i] = static_cast<float>(p[i] - low_[i]);
  }
  const NearInput input{start_.data(),   items_.data(),   at_m_[0].data(), at_m_[1].data(),
                        at_m_[2].data(), reach_m_.data(), cells_[0],       cells_[1]};
  return near_vertices(input, low, high, at, static_cast<float>(radius_m * 1.00001), most_found, found);
}

SectionWalker::SectionWalker(const BallMesh& mesh, const VertexGrid& grid)
    : mesh_(mesh), grid_(grid), near_(VertexGrid::most_found + 16) {}

SectionWalker::Plane SectionWalker::make_plane(const Vec3& center, const Vec3& axis,
                                               const Vec3& source) const {
  Vec3 u = axis.cross(Vec3::Unit(std::abs(axis.x()) < 0.6 ? 0 : 1));
  u /= std::sqrt(u.squaredNorm());
  const Vec3 v = axis.cross(u);
  Plane plane;
  for (int i = 0; i < 3; ++i) {
    plane.axis[i] = axis[i];
    plane.u[i] = u[i];
    plane.v[i] = v[i];
    plane.center[i] = center[i];
    plane.source[i] = source[i];
  }
  plane.offset = plane_offset(axis, center, mesh_.mean_edge_m);
  return plane;
}

inline double SectionWalker::height(const Plane& plane, int vertex) const {
  return plane_height(plane.axis, plane.offset, &mesh_.points[vertex].x);
}

inline double SectionWalker::along_v(const Plane& plane, int vertex) const {
  const BallMesh::Point& p = mesh_.points[vertex];
  return plane.v[0] * (p.x - plane.center[0]) + plane.v[1] * (p.y - plane.center[1]) +
         plane.v[2] * (p.z - plane.center[2]);
}

/// From the source to where the plane cuts the edge between p and q, h and g over it.
inline double SectionWalker::cut_distance2(const Plane& plane, const double* p, double h, const double* q,
                                           double g) {
  const double s = 1 / (h - g);
  double sum = 0;
  for (int i = 0; i < 3; ++i) sum += square((h * q[i] - g * p[i]) * s - plane.source[i]);
  return sum;
}

double SectionWalker::point_distance2(const Plane& plane, Crossing edge) const {
  const int above = static_cast<int>(edge >> 32), below = static_cast<int>(edge & 0xffffffff);
  return cut_distance2(plane, &mesh_.points[above].x, height(plane, above), &mesh_.points[below].x,
                       height(plane, below));
}

/// From the source to the piece of the plane in the triangle a b c, where the plane crosses the edge a b.
double SectionWalker::segment_distance2(const Plane& plane, int a, int b, int c) const {
  const auto cut = [&](int from, int to) {
    const double h = height(plane, from), g = height(plane, to);
    return Vec3((h * mesh_.position(to) - g * mesh_.position(from)) / (h - g));
  };
  const Vec3 first = cut(a, b), second = crosses(plane, a, c) ? cut(a, c) : cut(b, c);
  const Vec3 along = second - first, to = Vec3(plane.source[0], plane.source[1], plane.source[2]) - first;
  const double length2 = along.squaredNorm();
  const double t = length2 > 0 ? std::clamp(to.dot(along) / length2, 0.0, 1.0) : 0;
  return (t * along - to).squaredNorm();
}

bool SectionWalker::bounds_triangle(const LaneBall& ball, int half_edge) const {
  if (ball.has(mesh_.half_edges[half_edge].opposite)) return true;
  const int twin = mesh_.twin(half_edge);
  return twin >= 0 && ball.has(mesh_.half_edges[twin].opposite);
}

/// From the source step by step to a neighbour nearer to the plane, until an edge of a triangle of the ball
/// crosses it; that edge as a half-edge, or -1 where there is no way down. A ring's neighbours on both sides
/// of an edge are the corners opposite to it.
SectionWalker::Start SectionWalker::first_crossing(const LaneBall& ball, const Plane& plane,
                                                   int source) const {
  int at = source;
  double here = height(plane, at);
  for (;;) {
    Start start;
    int lower = -1, runs = 0;
    double low = std::abs(here);
    start.distance2 = std::numeric_limits<double>::infinity();
    const int first = mesh_.link_start[at], last = mesh_.link_start[at + 1];
    bool before = first < last && ball.has(mesh_.links.neighbour[last - 1]), crossed = false, wraps = false;
    bool inside = first < last && ball.has(mesh_.links.neighbour[first]);
    for (int i = first; i < last; ++i) {
      const int neighbour = mesh_.links.neighbour[i];
      const bool after = ball.has(mesh_.links.neighbour[i + 1 < last ? i + 1 : first]);
      bool crosses_here = false;
      if (inside) {
        const double other = height(plane, neighbour);
        crosses_here = (other >= 0) != (here >= 0);
        if (!crosses_here && std::abs(other) < low) {
          low = std::abs(other);
          lower = neighbour;
        }
        if (crosses_here && (before || after) && mesh_.links.half_edge[i] >= 0) {
          const double d = cut_distance2(plane, &mesh_.points[at].x, here, &mesh_.points[neighbour].x, other);
          if (d < start.distance2) {
            start.distance2 = d;
            start.half_edge = mesh_.links.half_edge[i];
          }
        }
      }
      runs += crosses_here && !crossed;
      if (i == first) wraps = crosses_here;
      crossed = crosses_here;
      before = inside;
      inside = after;
    }
    start.at_source = at == source;
    start.one_run = runs - (wraps && crossed && runs > 1) == 1;
    if (start.half_edge >= 0 || lower < 0) return start;
    at = lower;
    here = here >= 0 ? low : -low;
  }
}

SectionWalker::Tip SectionWalker::tip_at(const Plane& plane, int half_edge) const {
  Tip tip;
  tip.half_edge = tip.home = half_edge;
  const int from = mesh_.half_edges[half_edge].from, to = mesh_.to(half_edge);
  tip.from_above = height(plane, from) >= 0;
  tip.ends[0] = tip.from_above ? from : to;
  tip.ends[1] = tip.from_above ? to : from;
  for (int i = 0; i < 2; ++i) tip.places[i] = {height(plane, tip.ends[i]), along_v(plane, tip.ends[i])};
  tip.v = tip.places[0].height * tip.places[1].v - tip.places[1].height * tip.places[0].v;
  return tip;
}

/// The same edge entered from the other side.
SectionWalker::Tip SectionWalker::turned(const Tip& tip) const {
  Tip other = tip;
  other.half_edge = mesh_.twin(tip.half_edge);
  other.home = -2;
  other.from_above = !tip.from_above;
  return other;
}

/// Through the next triangle; false where that is not in the ball, or the walk has come home. Which way it
/// leaves is a toss-up, so that nothing branches on it.
inline bool SectionWalker::advance(const LaneBall& ball, const Plane& plane, Tip& tip) const {
  if (tip.half_edge < 0) return false;
  const BallMesh::HalfEdge& h = mesh_.half_edges[tip.half_edge];
  if (!ball.has(h.opposite)) return false;
  const double up = height(plane, h.opposite);
  const int side = up >= 0 ? 0 : 1;
  const int old_end = tip.ends[side];
  const End old_place = tip.places[side];
  tip.ends[side] = h.opposite;
  tip.places[side] = {up, along_v(plane, h.opposite)};
  tip.half_edge = h.exits[side ^ static_cast<int>(!tip.from_above)];
  const double v = tip.places[0].height * tip.places[1].v - tip.places[1].height * tip.places[0].v;
  if ((v >= 0) != (tip.v >= 0)) {
    const double u = u_of(plane, tip.ends, tip.places);
    int ends[2] = {tip.ends[0], tip.ends[1]};
    End places[2] = {tip.places[0], tip.places[1]};
    ends[side] = old_end;
    places[side] = old_place;
    const double cross = u_of(plane, ends, places) * v - u * tip.v;
    if (v < 0 && cross > 0) ++tip.turns;
    if (v >= 0 && cross < 0) --tip.turns;
  }
  tip.v = v;
  if (tip.noted < Tip::most_noted) tip.notes[tip.noted++] = crossing(tip.ends[0], tip.ends[1]);
  tip.closed = tip.half_edge == tip.home;
  return !tip.closed;
}

/// All walks that have begun, to their ends; backwards round a ring only as far as notes are taken.
void SectionWalker::walk(const std::vector<CutTask>& tasks, Tip Walk::*which) {
  steps_.clear();
  for (std::size_t i = 0; i < tasks.size(); ++i) {
    Walk& walk = walks_[i];
    if (walk.start.half_edge < 0) continue;
    const bool known = which == &Walk::behind && walk.ahead.closed;
    steps_.push_back({&walk.plane, &(walk.*which), tasks[i].ball.masks, tasks[i].ball.bit, known});
  }
  if (steps_.empty()) return;
  walk_sections({&mesh_.half_edges[0].opposite, &mesh_.points[0].x, tasks[0].ball.slot}, steps_.data(),
                static_cast<int>(steps_.size()));
}

void SectionWalker::take_angles(const Walk& walk, CutTask& task) const {
  if (walk.ahead.closed) {
    task.winding_rad = 2 * M_PI;
    task.accumulated_rad = std::abs(2 * M_PI * walk.ahead.turns);
    return;
  }
  const Tip &to = walk.ahead, &from = walk.behind;
  const double to_u = u_of(walk.plane, to.ends, to.places), from_u = u_of(walk.plane, from.ends, from.places);
  const double cross = from_u * to.v - from.v * to_u + 0.0, dot = from_u * to_u + from.v * to.v;
  // Both directions lie in (-pi, pi]: what leads from the lower half to the upper one turns left, and back.
  double angle = std::atan2(cross, dot);
  if (to.v >= 0 && from.v < 0 && cross < 0) angle += 2 * M_PI;
  if (to.v < 0 && from.v >= 0 && cross >= 0) angle -= 2 * M_PI;
  task.accumulated_rad = std::abs(angle + 2 * M_PI * (to.turns - from.turns));
  task.winding_rad = std::clamp(task.accumulated_rad, M_PI, 2 * M_PI);
}

/// How near the walk comes to the source, as far as its first steps go nearer: a bound from above.
double SectionWalker::nearest_noted2(const Walk& walk) const {
  double nearest2 = walk.start.distance2;
  for (const Tip* tip : {&walk.ahead, &walk.behind}) {
    double last = walk.start.distance2;
    for (int i = 0; i < tip->noted; ++i) {
      const double d = point_distance2(walk.plane, tip->notes[i]);
      if (d >= last) break;
      nearest2 = std::min(nearest2, last = d);
    }
  }
  return nearest2;
}

/// Whether no piece of the section but the walk, which has crossed those edges for which `walked` says so,
/// comes as near to the source as `bound2`. Every triangle that could hold such a piece has a corner within
/// `outermost` times its longest side of the disc in which the plane cuts the sphere of that radius around
/// the source. The source's own edges are the walk's where they cross the plane in one run.
template <class Walked>
bool SectionWalker::is_nearest(const CutTask& task, const Walk& walk, double bound2, const Walked& walked) {
  const LaneBall& ball = task.ball;
  const Plane& plane = walk.plane;
  const double up = plane_height(plane.axis, plane.offset, plane.source);
  const double foot[3] = {plane.source[0] - up * plane.axis[0], plane.source[1] - up * plane.axis[1],
                          plane.source[2] - up * plane.axis[2]};
  const double disc = std::sqrt(std::max(0.0, bound2 - up * up));
  const auto other_piece = [&](int v) {
    const bool above = height(plane, v) >= 0;
    const int first = mesh_.link_start[v], last = mesh_.link_start[v + 1];
    for (int i = first; i < last; ++i) {
      const int w = mesh_.links.neighbour[i];
      if (w == mesh_.count || (height(plane, w) >= 0) == above || !ball.has(w)) continue;
      if (above ? walked(v, w) : walked(w, v)) continue;
      for (int j : {i + 1 < last ? i + 1 : first, i > first ? i - 1 : last - 1}) {
        const int third = mesh_.links.neighbour[j];
        if (ball.has(third) && segment_distance2(plane, v, w, third) <= bound2) return true;
      }
    }
    return false;
  };
  const int near = grid_.around(foot, disc, near_.data());
  const int known = walk.start.at_source && walk.start.one_run ? task.source : -1;
  for (int i = 0; i < near; ++i)
    if (near_[i] != known && ball.has(near_[i]) && other_piece(near_[i])) return false;
  return near >= 0;
}

/// With what the walk has noted first; where it has gone on without notes, with all that it crosses.
bool SectionWalker::is_nearest(const CutTask& task, const Walk& walk) {
  const int from = mesh_.half_edges[walk.start.half_edge].from, to = mesh_.to(walk.start.half_edge);
  const double bound2 = walk.start.at_source ? walk.start.distance2 : nearest_noted2(walk);
  const bool noted = is_nearest(task, walk, bound2 * rounding, [&](int above, int below) {
    const Crossing key = crossing(above, below);
    if ((above == from && below == to) || (above == to && below == from)) return true;
    for (const Tip* tip : {&walk.ahead, &walk.behind})
      if (std::find(tip->notes, tip->notes + tip->noted, key) != tip->notes + tip->noted) return true;
    return false;
  });
  if (noted || std::max(walk.ahead.noted, walk.behind.noted) < Tip::most_noted) return noted;
  std::vector<Crossing> all;
  const double nearest2 = walk_both_ways(task.ball, walk.plane, walk.start.half_edge, all).nearest2;
  std::sort(all.begin(), all.end());
  return is_nearest(task, walk, nearest2 * rounding, [&](int above, int below) {
    return std::binary_search(all.begin(), all.end(), crossing(above, below));
  });
}

double SectionWalker::walk_noting_all(const LaneBall& ball, const Plane& plane, Tip& tip,
                                      std::vector<Crossing>& all) const {
  double nearest2 = std::numeric_limits<double>::infinity();
  for (bool on = true; on;) {
    const int before[2] = {tip.ends[0], tip.ends[1]};
    on = advance(ball, plane, tip);
    const int third = tip.ends[0] != before[0] ? tip.ends[0] : tip.ends[1];
    if (third == before[1]) break;  // it could not go on
    nearest2 = std::min(nearest2, segment_distance2(plane, before[0], before[1], third));
    all.push_back(crossing(tip.ends[0], tip.ends[1]));
  }
  return nearest2;
}

/// From a half-edge on, to both ends or round, noting all.
SectionWalker::Walk SectionWalker::walk_both_ways(const LaneBall& ball, const Plane& plane, int half_edge,
                                                  std::vector<Crossing>& all) const {
  Walk walk{plane, {half_edge}, tip_at(plane, half_edge), {}};
  walk.behind = turned(walk.ahead);
  all.assign(1, crossing(walk.ahead.ends[0], walk.ahead.ends[1]));
  walk.nearest2 = walk_noting_all(ball, plane, walk.ahead, all);
  if (!walk.ahead.closed)
    walk.nearest2 = std::min(walk.nearest2, walk_noting_all(ball, plane, walk.behind, all));
  return walk;
}

/// All pieces one after the other; the nearest one counts.
void SectionWalker::search_whole(CutTask& task, const Plane& plane) {
  ++searched_whole;
  task.winding_rad = task.accumulated_rad = std::nan("");
  double least = std::numeric_limits<double>::infinity();
  std::unordered_set<Crossing> walked;
  seen_.resize(static_cast<std::size_t>(mesh_.count));
  queue_.assign(1, task.source);
  seen_[task.source] = 1;
  std::vector<Crossing> all;
  for (std::size_t head = 0; head < queue_.size(); ++head) {
    const int v = queue_[head];
    for (int i = mesh_.link_start[v]; i < mesh_.link_start[v + 1]; ++i) {
      const int neighbour = mesh_.links.neighbour[i], half_edge = mesh_.links.half_edge[i];
      if (!task.ball.has(neighbour)) continue;
      if (!seen_[neighbour]) queue_.push_back(neighbour);
      seen_[neighbour] = 1;
      if (half_edge < 0 || !crosses(plane, v, neighbour)) continue;
      if (walked.count(crossing(v, neighbour)) || walked.count(crossing(neighbour, v))) continue;
      if (!bounds_triangle(task.ball, half_edge)) continue;
      const Walk walk = walk_both_ways(task.ball, plane, half_edge, all);
      walked.insert(all.begin(), all.end());
      if (walk.nearest2 >= least) continue;
      least = walk.nearest2;
      take_angles(walk, task);
    }
  }
  for (int v : queue_) seen_[v] = 0;
}

void SectionWalker::measure(std::vector<CutTask>& tasks) {
  const int count = static_cast<int>(tasks.size());
  walks_.resize(tasks.size());
  for (int i = 0; i < count; ++i) {
    Walk& walk = walks_[i];
    walk.plane = make_plane(tasks[i].center, tasks[i].axis, mesh_.position(tasks[i].source));
    walk.start = first_crossing(tasks[i].ball, walk.plane, tasks[i].source);
    if (walk.start.half_edge < 0) continue;
    walk.ahead = tip_at(walk.plane, walk.start.half_edge);
    walk.behind = turned(walk.ahead);
  }
  walk(tasks, &Walk::ahead);
  walk(tasks, &Walk::behind);
  for (int i = 0; i < count; ++i)
    if (walks_[i].start.half_edge >= 0 && is_nearest(tasks[i], walks_[i]))
      take_angles(walks_[i], tasks[i]);
    else
      search_whole(tasks[i], walks_[i].plane);
}

}  // namespace geocage::topology
