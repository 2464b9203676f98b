#include "geometry/surface_distance.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <embree3/rtcore.h>

namespace geocage::geometry {

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

/// Nearest point to r of the segment between 0 and `along`.
Vec3 segment_point(const Vec3& r, const Vec3& along) {
  const double length2 = along.squaredNorm();
  return (length2 > 0 ? std::clamp(r.dot(along) / length2, 0.0, 1.0) : 0) * along;
}
double segment_distance2(const Vec3& r, const Vec3& along) {
  return (r - segment_point(r, along)).squaredNorm();
}

}  // namespace

Facet::Facet(const Vec3& corner_a, const Vec3& b, const Vec3& c) : a(corner_a), ab(b - a), ac(c - a) {
  const Vec3 n = ab.cross(ac);
  normal = n / n.norm();
  to_b = ac.cross(n) / n.squaredNorm();
  to_c = n.cross(ab) / n.squaredNorm();
}

double Facet::distance2(const Vec3& p, double limit2) const {
  const Vec3 ap = p - a;
  const double height = normal.dot(ap);
  if (height * height >= limit2) return limit2;
  // Barycentric coordinates of the foot of p. Outside, the nearest point lies on a side that the foot is
  // beyond.
  const double at_b = to_b.dot(ap), at_c = to_c.dot(ap), at_a = 1 - at_b - at_c;
  if (at_a >= 0 && at_b >= 0 && at_c >= 0) return height * height;
  double least = limit2;
  if (!(at_c >= 0)) least = std::min(least, segment_distance2(ap, ab));
  if (!(at_b >= 0)) least = std::min(least, segment_distance2(ap, ac));
  if (!(at_a >= 0)) least = std::min(least, segment_distance2(ap - ab, ac - ab));
  return least;
}

Vec3 Facet::nearest_point(const Vec3& p) const {
  const Vec3 ap = p - a;
  const double at_b = to_b.dot(ap), at_c = to_c.dot(ap), at_a = 1 - at_b - at_c;
  if (at_a >= 0 && at_b >= 0 && at_c >= 0) return p - normal.dot(ap) * normal;
  const std::array<Vec3, 3> sides = {segment_point(ap, ab), segment_point(ap, ac),
                                     ab + segment_point(ap - ab, ac - ab)};
  return a + *std::min_element(sides.begin(), sides.end(), [&](const Vec3& x, const Vec3& y) {
           return (ap - x).squaredNorm() < (ap - y).squaredNorm();
         });
}

struct SurfaceDistance::Query {
  const SurfaceDistance* surface;
  Vec3 p;
  double best2;
  int nearest;
  const Vec3* facing = nullptr;  ///< only triangles that face this way count
  double least_cos = 0;
};

SurfaceDistance::Box SurfaceDistance::box_of(const TriangleMesh& mesh) {
  Vec3 low = Vec3::Constant(infinity), high = -low;
  for (const auto& t : mesh.triangles)
    for (int v : t) {
      low = low.cwiseMin(mesh.vertices[v]);
      high = high.cwiseMax(mesh.vertices[v]);
    }
  return {(low + high) / 2, (high - low).norm()};
}

SurfaceDistance::SurfaceDistance(const TriangleMesh& mesh) : SurfaceDistance(mesh, box_of(mesh)) {}

SurfaceDistance::SurfaceDistance(const TriangleMesh& mesh, const Box& box)
    : center_(box.center), slack_m_(1e-6 * box.diagonal_m), scene_(mesh, box.center) {
  facets_.reserve(mesh.triangles.size());
  for (const auto& t : mesh.triangles)
    facets_.emplace_back(mesh.vertices[t[0]] - center_, mesh.vertices[t[1]] - center_,
                         mesh.vertices[t[2]] - center_);
}

double SurfaceDistance::distance_m(const Vec3& p_O, int& nearest) const {
  const Vec3 p = p_O - center_;
  Query query{this, p, facets_[nearest].distance2(p, infinity), nearest};
  search(query);
  nearest = query.nearest;
  return std::sqrt(query.best2);
}

double SurfaceDistance::distance_within(const Vec3& p_O, double limit_m) const {
  Query query{this, p_O - center_, limit_m * limit_m, 0};
  search(query);
  return std::sqrt(query.best2);
}

SurfaceDistance::Foot SurfaceDistance::foot(const Vec3& p_O, int& nearest) const {
  const double distance = distance_m(p_O, nearest);
  return {facets_[nearest].nearest_point(p_O - center_) + center_, distance};
}

std::optional<SurfaceDistance::Foot> SurfaceDistance::foot_facing(const Vec3& p_O, const Vec3& normal_O,
                                                                  double least_cos, double within_m,
                                                                  int& nearest) const {
  const Vec3 p = p_O - center_;
  const double limit2 = within_m * within_m;
  const bool faces = facets_[nearest].normal.dot(normal_O) > least_cos;
  Query query{this, p, faces ? facets_[nearest].distance2(p, limit2) : limit2, nearest, &normal_O, least_cos};
  search(query);
  if (query.best2 >= limit2) return {};
  nearest = query.nearest;
  return Foot{facets_[nearest].nearest_point(p) + center_, std::sqrt(query.best2)};
}

void SurfaceDistance::search(Query& query) const {
  RTCPointQuery ball{};
  ball.x = static_cast<float>(query.p.x());
  ball.y = static_cast<float>(query.p.y());
  ball.z = static_cast<float>(query.p.z());
  ball.radius = search_radius(query.best2);
  RTCPointQueryContext context;
  rtcInitPointQueryContext(&context);
  rtcPointQuery(scene_.handle(), &ball, &context, &visit_triangle, &query);
}

Vec3 SurfaceDistance::barycentric(const Vec3& p_O, int triangle) const {
  const Facet& facet = facets_[triangle];
  const Vec3 ap = p_O - center_ - facet.a;
  const double at_b = facet.to_b.dot(ap), at_c = facet.to_c.dot(ap);
  return {1 - at_b - at_c, at_b, at_c};
}

bool SurfaceDistance::inside(const Vec3& p_O) const {
  static const Vec3 directions[5] = {{0.577, 0.601, 0.553},
                                     {-0.613, 0.251, 0.749},
                                     {0.137, -0.911, 0.389},
                                     {-0.407, -0.331, -0.851},
                                     {0.883, 0.173, -0.437}};
  int votes = 0;
  for (const Vec3& along : directions)
    if (const auto hit = scene_.first_hit(p_O, along)) votes += hit->from_behind;
  return votes >= 3;
}

/// A little more than the best distance, by what single precision may lose.
float SurfaceDistance::search_radius(double best2) const {
  return static_cast<float>(std::sqrt(best2) * (1 + 1e-5) + slack_m_);
}

bool SurfaceDistance::visit_triangle(RTCPointQueryFunctionArguments* arguments) {
  auto& query = *static_cast<Query*>(arguments->userPtr);
  const Facet& facet = query.surface->facets_[arguments->primID];
  if (query.facing && !(facet.normal.dot(*query.facing) > query.least_cos)) return false;
  const auto triangle = static_cast<int>(arguments->primID);
  const double d2 = facet.distance2(query.p, std::nextafter(query.best2, infinity));
  // Of several at one distance the first by number, whatever order the tree is walked in.
  if (d2 > query.best2 || (d2 == query.best2 && triangle >= query.nearest)) return false;
  query.best2 = d2;
  query.nearest = triangle;
  arguments->query->radius = query.surface->search_radius(d2);
  return true;
}

namespace {

/// Farthest sample and area integrals of the distance and its square, of some triangles.
struct Tally {
  double max_m = 0, integral = 0, squares = 0, area = 0;
  int farthest = 0;

  void add_sample(double distance, int triangle) {
    if (distance <= max_m) return;
    max_m = distance;
    farthest = triangle;
  }
};

void add_triangle(const TriangleMesh& mesh, int triangle, const SurfaceDistance& to, double spacing_m,
                  int& nearest, Tally& tally) {
  for_samples(mesh, triangle, spacing_m, [&](const Vec3& p, double part) {
    const double d = to.distance_m(p, nearest);
    tally.integral += d * part;
    tally.squares += d * d * part;
    tally.area += part;
    tally.add_sample(d, triangle);
  });
}

}  // namespace

Deviation deviation(const TriangleMesh& from, const SurfaceDistance& to, double spacing_m) {
  constexpr int chunk = 256;  // fixed, so that sums do not depend on threads
  const int count = static_cast<int>(from.triangles.size()), chunks = (count + chunk - 1) / chunk;
  std::vector<Tally> tallies(static_cast<std::size_t>(chunks));
  std::vector<int> first(from.vertices.size(), count);  // the triangle that measures a corner
  for (int f = count - 1; f >= 0; --f)
    for (int v : from.triangles[f]) first[v] = f;
#pragma omp parallel for schedule(dynamic, 1)
  for (int c = 0; c < chunks; ++c) {
    int nearest = 0;
    for (int f = c * chunk; f < std::min(count, (c + 1) * chunk); ++f) {
      add_triangle(from, f, to, spacing_m, nearest, tallies[c]);
      for (int v : from.triangles[f])
        if (first[v] == f) tallies[c].add_sample(to.distance_m(from.vertices[v], nearest), f);
    }
  }
  Tally all;
  for (const Tally& tally : tallies) {
    all.add_sample(tally.max_m, tally.farthest);
    all.integral += tally.integral;
    all.squares += tally.squares;
    all.area += tally.area;
  }
  if (!(all.area > 0)) return {all.max_m, 0, 0, spacing_m, all.farthest};
  return {all.max_m, all.integral / all.area, std::sqrt(all.squares / all.area), spacing_m, all.farthest};
}

}  // namespace geocage::geometry
