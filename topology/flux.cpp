#include "topology/flux.h"

#include <cmath>
#include <numbers>

namespace geocage::topology {

double triangle_flux_sr(const Vec3& x, const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 p = a - x, q = b - x, r = c - x;
  const double lp = p.norm(), lq = q.norm(), lr = r.norm();
  if (lp == 0 || lq == 0 || lr == 0) return 0;
  const double volume = p.dot(q.cross(r));
  if (volume == 0) return 0;  // x in the triangle's plane: no side to see
  return 2 * std::atan2(volume, lp * lq * lr + p.dot(q) * lr + q.dot(r) * lp + r.dot(p) * lq);
}

double surface_flux_sr(const Vec3& x, const geometry::TriangleMesh& surface) {
  double flux = 0;
  for (const auto& t : surface.triangles)
    flux += triangle_flux_sr(x, surface.vertices[t[0]], surface.vertices[t[1]], surface.vertices[t[2]]);
  return flux;
}

double flux_share(const geometry::TriangleMesh& object, const geometry::TriangleMesh& surface) {
  double flux = 0, area = 0;
  for (const auto& t : object.triangles) {
    const Vec3 &a = object.vertices[t[0]], &b = object.vertices[t[1]], &c = object.vertices[t[2]];
    const double twice_area = (b - a).cross(c - a).norm();
    area += twice_area;
    const Vec3 center = (a + b + c) / 3;
    for (const Vec3& x : {center, Vec3((center + a) / 2), Vec3((center + b) / 2), Vec3((center + c) / 2)})
      flux += twice_area / 4 * surface_flux_sr(x, surface);
  }
  return area > 0 ? flux / (4 * std::numbers::pi * area) : 0;
}

}  // namespace geocage::topology
