#include "geometry/noise.h"

#include <cmath>

namespace geocage::geometry {

double RandomStream::uniform() {
  return static_cast<double>((engine_() >> 11) + 1) * 0x1p-53;
}

double RandomStream::normal() {
  const double radius = std::sqrt(-2 * std::log(uniform())), angle = 2 * M_PI * uniform();
  return radius * std::cos(angle);
}

Vec3 RandomStream::normal_vector() {
  const double x = normal(), y = normal(), z = normal();
  return {x, y, z};
}

Vec3 RandomStream::direction() {
  const double z = 2 * uniform() - 1, angle = 2 * M_PI * uniform(), r = std::sqrt(1 - z * z);
  return {r * std::cos(angle), r * std::sin(angle), z};
}

TriangleMesh with_vertex_noise(const TriangleMesh& mesh, double sigma_m, NoiseDirection direction,
                               std::uint64_t seed) {
  RandomStream random(seed, 0);
  TriangleMesh noisy = mesh;
  const auto normals = direction == NoiseDirection::normal ? vertex_normals(mesh) : std::vector<Vec3>{};
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
    noisy.vertices[v] +=
        sigma_m * (normals.empty() ? random.normal_vector() : Vec3(random.normal() * normals[v]));
  return noisy;
}

}  // namespace geocage::geometry
