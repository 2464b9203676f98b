#include "geometry/surface_distance.h"

#include <algorithm>
#include <cmath>

namespace geocage::geometry {

namespace {

struct Sums {
  double area = 0, first = 0, second = 0, most = 0;
  std::size_t samples = 0;
};

void measure_triangle(const Vec3& a, const Vec3& ab, const Vec3& ac, const Surface& to, double spacing_m,
                      unsigned& nearest, Sums& sums) {
  const double longest = std::sqrt(std::max({ab.squaredNorm(), ac.squaredNorm(), (ac - ab).squaredNorm()}));
  const int k = std::max(1, static_cast<int>(std::ceil(longest / spacing_m)));
  const double part = ab.cross(ac).norm() / 2 / k / k;
  const auto measure = [&](double at_b, double at_c) {
    const double d = to.distance_m(a + at_b / k * ab + at_c / k * ac, nearest);
    sums.area += part;
    sums.first += part * d;
    sums.second += part * d * d;
    sums.most = std::max(sums.most, d);
    ++sums.samples;
  };
  for (int i = 0; i < k; ++i)
    for (int j = 0; i + j < k; ++j) {
      measure(i + 1.0 / 3, j + 1.0 / 3);
      if (i + j + 1 < k) measure(i + 2.0 / 3, j + 2.0 / 3);
    }
}

}  // namespace

OneSidedDistance distance_from_to(const TriangleMesh& from, const Surface& to, double spacing_m) {
  constexpr std::size_t chunk = 256;
  const std::size_t triangles = from.triangles.size(), vertices = from.vertices.size();
  const std::size_t triangle_chunks = (triangles + chunk - 1) / chunk;
  std::vector<Sums> parts(triangle_chunks + (vertices + chunk - 1) / chunk);
#pragma omp parallel for schedule(dynamic, 1)
  for (std::size_t c = 0; c < parts.size(); ++c) {
    unsigned nearest = 0;
    if (c < triangle_chunks) {
      for (std::size_t f = c * chunk; f < std::min(triangles, (c + 1) * chunk); ++f) {
        const auto& t = from.triangles[f];
        const Vec3& a = from.vertices[t[0]];
        measure_triangle(a, from.vertices[t[1]] - a, from.vertices[t[2]] - a, to, spacing_m, nearest,
                         parts[c]);
      }
    } else {
      for (std::size_t v = (c - triangle_chunks) * chunk;
           v < std::min(vertices, (c - triangle_chunks + 1) * chunk); ++v) {
        parts[c].most = std::max(parts[c].most, to.distance_m(from.vertices[v], nearest));
        ++parts[c].samples;
      }
    }
  }
  Sums all;
  for (const Sums& part : parts) {
    all.area += part.area;
    all.first += part.first;
    all.second += part.second;
    all.most = std::max(all.most, part.most);
    all.samples += part.samples;
  }
  return {all.first / all.area, std::sqrt(all.second / all.area), all.most, all.samples};
}

SurfaceDistance surface_distance(const TriangleMesh& a, const TriangleMesh& b, double spacing_m) {
  return {distance_from_to(a, Surface(b), spacing_m), distance_from_to(b, Surface(a), spacing_m)};
}

}  // namespace geocage::geometry
