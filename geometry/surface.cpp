#include "geometry/surface.h"

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

Surface::Facet::Facet(const Vec3& corner_a, const Vec3& b, const Vec3& c)
    : a(corner_a), ab(b - a), ac(c - a) {
  const Vec3 n = ab.cross(ac);
  normal = n / n.norm();
  to_b = ac.cross(n) / n.squaredNorm();
  to_c = n.cross(ab) / n.squaredNorm();
}

/// Squared distance of p where it is less than `limit2`, else `limit2`.
double Surface::Facet::distance2(const Vec3& p, double limit2) const {
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

Vec3 Surface::Facet::nearest_point(const Vec3& p) const {
  const Vec3 ap = p - a;
  const double at_b = to_b.dot(ap), at_c = to_c.dot(ap), at_a = 1 - at_b - at_c;
  if (at_a >= 0 && at_b >= 0 && at_c >= 0) return p - normal.dot(ap) * normal;
  const std::array<Vec3, 3> sides = {segment_point(ap, ab), segment_point(ap, ac),
                                     ab + segment_point(ap - ab, ac - ab)};
  return a + *std::min_element(sides.begin(), sides.end(), [&](const Vec3& x, const Vec3& y) {
           return (ap - x).squaredNorm() < (ap - y).squaredNorm();
         });
}

Surface::Surface(const TriangleMesh& mesh) : Surface(mesh, check_mesh(mesh)) {}

Surface::Surface(const TriangleMesh& mesh, const MeshReport& report)
    : slack_m_(1e-6 * report.diagonal_m()), scene_(mesh, (report.box_min + report.box_max) / 2) {
  const Vec3& center = scene_.center();
  for (const auto& t : mesh.triangles)
    facets_.emplace_back(mesh.vertices[t[0]] - center, mesh.vertices[t[1]] - center,
                         mesh.vertices[t[2]] - center);
}

double Surface::distance_m(const Vec3& p_O, unsigned& nearest) const {
  const Vec3 p = p_O - scene_.center();
  Query query{this, p, {}, facets_[nearest].distance2(p, infinity), nearest};
  search(query);
  nearest = *query.nearest;
  return std::sqrt(query.best2);
}

Surface::Foot Surface::foot(const Vec3& p_O, unsigned& nearest) const {
  const double distance = distance_m(p_O, nearest);
  return {facets_[nearest].nearest_point(p_O - scene_.center()) + scene_.center(), distance};
}

std::optional<Surface::Foot> Surface::foot_facing(const Vec3& p_O, const Vec3& normal_O, double least_cos,
                                                  double within_m, unsigned& nearest) const {
  const Vec3 p = p_O - scene_.center();
  Query query{this, p, normal_O, within_m * within_m, {}, least_cos};
  if (facets_[nearest].normal.dot(normal_O) > least_cos) {
    query.best2 = facets_[nearest].distance2(p, query.best2);
    if (query.best2 < within_m * within_m) query.nearest = nearest;
  }
  search(query);
  if (!query.nearest) return {};
  nearest = *query.nearest;
  return Foot{facets_[nearest].nearest_point(p) + scene_.center(), std::sqrt(query.best2)};
}

Vec3 Surface::barycentric(const Vec3& p_O, unsigned triangle) const {
  const Facet& facet = facets_[triangle];
  const Vec3 ap = p_O - scene_.center() - facet.a;
  const double at_b = facet.to_b.dot(ap), at_c = facet.to_c.dot(ap);
  return {1 - at_b - at_c, at_b, at_c};
}

bool Surface::inside(const Vec3& p_O) const {
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

void Surface::search(Query& query) const {
  RTCPointQuery ball{};
  ball.x = static_cast<float>(query.p.x());
  ball.y = static_cast<float>(query.p.y());
  ball.z = static_cast<float>(query.p.z());
  ball.radius = search_radius(query.best2);
  RTCPointQueryContext context;
  rtcInitPointQueryContext(&context);
  rtcPointQuery(scene_.handle(), &ball, &context, &visit_triangle, &query);
}

/// A little more than the best distance, by what single precision may lose.
float Surface::search_radius(double best2) const {
  return static_cast<float>(std::sqrt(best2) * (1 + 1e-5) + slack_m_);
}

bool Surface::visit_triangle(RTCPointQueryFunctionArguments* arguments) {
  auto& query = *static_cast<Query*>(arguments->userPtr);
  const Facet& facet = query.surface->facets_[arguments->primID];
  if (query.facing && !(facet.normal.dot(*query.facing) > query.least_cos)) return false;
  const double d2 = facet.distance2(query.p, query.best2);
  if (d2 >= query.best2) return false;
  query.best2 = d2;
  query.nearest = arguments->primID;
  arguments->query->radius = query.surface->search_radius(d2);
  return true;
}

}  // namespace geocage::geometry
