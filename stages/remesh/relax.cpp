#include <algorithm>
#include <cmath>

#include "geometry/crossings.h"
#include "stages/remesh/remesher.h"

namespace geocage::stages {

using geometry::Vec3;

namespace {
constexpr double fold_cos = 0.5;  // 60 degrees
constexpr double turn_cos = 0.5;  // a triangle turns less than that in one move
}  // namespace

double cos_between(const Vec3& a, const Vec3& b) {
  const double n2 = a.squaredNorm() * b.squaredNorm();
  return n2 > 0 ? a.dot(b) / std::sqrt(n2) : -1;
}

double least_angle(const Vec3& a, const Vec3& b, const Vec3& c) {
  // The smallest angle lies opposite the shortest side, so one arc tangent will do.
  const Vec3 ab = b - a, bc = c - b, ca = a - c;
  const double ab2 = ab.squaredNorm(), bc2 = bc.squaredNorm(), ca2 = ca.squaredNorm();
  const double cosine = ab2 <= bc2 && ab2 <= ca2 ? -bc.dot(ca) : bc2 <= ca2 ? -ca.dot(ab) : -ab.dot(bc);
  return std::atan2(ab.cross(ca).norm(), cosine);
}

Remesher::Remesher(const geometry::TriangleMesh& source, double edge_m)
    : source_(source), mesh_(source), edge_m_(edge_m), flat_m2_(1e-3 * edge_m * edge_m) {
  near_.assign(static_cast<std::size_t>(mesh_.slots()), 0);
  for (int h = 0; h < mesh_.halfedges(); ++h) near_[mesh_.from(h)] = h / 3;
}

/// The surface turns by more than 60 degrees over the edge of h: a crease, or the rim of a thin wall.
bool Remesher::folded(int h) const {
  const Vec3 n1 = mesh_.double_area_normal(h), n2 = mesh_.double_area_normal(mesh_.twin(h));
  if (n1.dot(n2) >= fold_cos * std::sqrt(n1.squaredNorm() * n2.squaredNorm())) return false;
  const double slim2 = std::pow(0.05 * edge_m_ * edge_m_, 2);
  return n1.squaredNorm() > slim2 && n2.squaredNorm() > slim2;
}

Remesher::Folds Remesher::folds(int v) const {
  Folds folds;
  mesh_.around(v, [&](int h) {
    if (!folded(h)) return;
    if (folds.count < 2) folds.ends[folds.count] = mesh_.to(h);
    ++folds.count;
  });
  return folds;
}

Vec3 Remesher::ring_normal(int v) const {
  Vec3 normal = Vec3::Zero();
  mesh_.around(v, [&](int h) { normal += mesh_.double_area_normal(h); });
  return normal.normalized();
}

bool Remesher::keeps_faces(int v, const Vec3& p) const {
  bool good = true;
  mesh_.around(v, [&](int h) {
    const Vec3 before = mesh_.double_area_normal(h);
    if (before.squaredNorm() > flat_m2_ * flat_m2_)
      good &= cos_between(before, mesh_.double_area_normal_with(h, v, p)) >= turn_cos;
  });
  return good;
}

/// The nearest point of the source that faces the same way; a vertex on a rim so finds the rim.
Vec3 Remesher::projected(const Vec3& p, const Vec3& normal, int v) {
  for (double least_cos : {0.7, 0.0})
    if (const auto foot = source_.foot_facing(p, normal, least_cos, edge_m_, near_[v])) return foot->point_O;
  return source_.foot(p, near_[v]).point_O;
}

/// Where smoothing would move v by: along a fold on it, not at all where folds meet.
Vec3 Remesher::wish(int v) const {
  const Vec3& p = mesh_.position[v];
  const Folds fold = folds(v);
  if (fold.count > 2) return Vec3::Zero();
  if (fold.count == 2) {
    const Vec3 &x = mesh_.position[fold.ends[0]], &y = mesh_.position[fold.ends[1]];
    const Vec3 along = (y - x).normalized();
    return along * along.dot((x + y) / 2 - p) / 2;
  }
  // The area-weighted mean of the triangles' centroids, of which p is a third: 3/2 undoes most of that.
  Vec3 sum = Vec3::Zero(), normal = Vec3::Zero();
  double weight = 0;
  mesh_.around(v, [&](int h) {
    const Vec3 n = mesh_.double_area_normal(h);
    const double area = n.norm();
    sum += area / 3 * (mesh_.position[mesh_.to(h)] + mesh_.position[mesh_.opposite(h)] - 2 * p);
    normal += n;
    weight += area;
  });
  if (!(weight > 0) || normal.squaredNorm() == 0) return Vec3::Zero();
  normal.normalize();
  const Vec3 move = 1.5 / weight * sum;
  return move - normal.dot(move) * normal;
}

void Remesher::relax_vertex(int v) {
  const Vec3 p = mesh_.position[v], move = wish(v), normal = ring_normal(v);
  for (double step : {1.0, 0.5}) {
    const Vec3 q = projected(p + step * move, normal, v);
    if (!keeps_faces(v, q)) continue;
    mesh_.position[v] = q;
    return;
  }
}

void Remesher::relax(int rounds) {
  for (int round = 0; round < rounds; ++round)
    for (int v = 0; v < mesh_.slots(); ++v)
      if (mesh_.vertex_alive(v)) relax_vertex(v);
}

void Remesher::remove_slim(double low_rad) {
  for (int h = 0; h < mesh_.halfedges(); h += 3) {
    if (!mesh_.alive(h) || least_angle(h) >= low_rad) continue;
    int shortest = h;
    for (int side : {h + 1, h + 2})
      if (mesh_.length2(side) < mesh_.length2(shortest)) shortest = side;
    const std::array<int, 2> ends = {mesh_.from(shortest), mesh_.to(shortest)};
    if (!collapse_either(shortest, 2 * edge_m_)) continue;
    const int kept = mesh_.vertex_alive(ends[0]) ? ends[0] : ends[1];
    std::vector<int> near = {kept};
    mesh_.around(kept, [&](int x) { near.push_back(mesh_.to(x)); });
    for (int round = 0; round < 4; ++round)
      for (int v : near) relax_vertex(v);
  }
}

double Remesher::least_angle(int h) const {
  return stages::least_angle(mesh_.position[mesh_.from(h)], mesh_.position[mesh_.to(h)],
                             mesh_.position[mesh_.opposite(h)]);
}

double Remesher::least_angle_around(int v, const Vec3& p) const {
  double least = M_PI;
  mesh_.around(v, [&](int h) {
    least = std::min(least,
                     stages::least_angle(p, mesh_.position[mesh_.to(h)], mesh_.position[mesh_.opposite(h)]));
  });
  return least;
}

void Remesher::lift_angles(double low_rad) {
  std::vector<int> corners;
  for (int h = 0; h < mesh_.halfedges(); h += 3)
    if (mesh_.alive(h) && least_angle(h) < low_rad)
      for (int i = 0; i < 3; ++i) corners.push_back(mesh_.from(h + i));
  std::sort(corners.begin(), corners.end());
  corners.erase(std::unique(corners.begin(), corners.end()), corners.end());
  for (int v : corners) {
    const Vec3 normal = ring_normal(v), x = normal.unitOrthogonal(), y = normal.cross(x);
    double best = least_angle_around(v, mesh_.position[v]);
    for (double step = 0.15 * edge_m_; step > 0.01 * edge_m_; step /= 2)
      for (int k = 0; k < 8; ++k) {
        const double at = k * M_PI / 4;
        const Vec3 q = projected(mesh_.position[v] + step * (std::cos(at) * x + std::sin(at) * y), normal, v);
        const double angle = least_angle_around(v, q);
        if (angle <= best || !keeps_faces(v, q)) continue;
        best = angle;
        mesh_.position[v] = q;
      }
  }
}

void Remesher::part_cuts(int rounds) {
  for (int round = 0; round < rounds; ++round) {
    const auto pairs = geometry::crossing_triangles(mesh_.mesh());
    if (pairs.empty()) return;
    std::vector<int> triangles;  // those of mesh_.mesh(), in its order
    for (int h = 0; h < mesh_.halfedges(); h += 3)
      if (mesh_.alive(h)) triangles.push_back(h);
    const auto middle = [&](int h) {
      return Vec3(
          (mesh_.position[mesh_.from(h)] + mesh_.position[mesh_.to(h)] + mesh_.position[mesh_.opposite(h)]) /
          3);
    };
    // Two sides of a wall lie behind each other and move outward, two solids that touch move inward.
    std::vector<std::pair<int, int>> moves;
    for (const auto& [f, g] : pairs) {
      const int a = triangles[f], b = triangles[g];
      const bool behind = mesh_.double_area_normal(a).dot(middle(b) - middle(a)) +
                              mesh_.double_area_normal(b).dot(middle(a) - middle(b)) <
                          0;
      for (int h : {a, b})
        for (int corner : {mesh_.from(h), mesh_.to(h), mesh_.opposite(h)})
          moves.emplace_back(corner, behind ? 1 : -1);
    }
    std::sort(moves.begin(), moves.end());
    moves.erase(std::unique(moves.begin(), moves.end()), moves.end());
    for (const auto& [v, sign] : moves) {
      const Vec3 q = mesh_.position[v] + 0.2 * wish(v) + sign * 0.03 * edge_m_ * ring_normal(v);
      if (keeps_faces(v, q)) mesh_.position[v] = q;
    }
  }
}

}  // namespace geocage::stages
