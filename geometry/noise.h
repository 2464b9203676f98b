#pragma once
#include <cstdint>
#include <random>

#include "geometry/mesh.h"

namespace geocage::geometry {

/// Random numbers of one stream of one seed. The same on every machine: the standard's distributions are not.
class RandomStream {
 public:
  RandomStream(std::uint64_t seed, std::uint64_t stream) : engine_(seed * 0x9e3779b97f4a7c15u + stream) {}
  double uniform();      ///< in (0, 1]
  double normal();       ///< mean 0, deviation 1 (Box and Muller 1958); takes two uniform numbers
  Vec3 normal_vector();  ///< three of them
  Vec3 direction();      ///< unit, even over the sphere

 private:
  std::mt19937_64 engine_;
};

enum class NoiseDirection { normal, isotropic };

/// The mesh with each vertex moved by a Gaussian number of deviation `sigma_m`: along its area-weighted
/// normal, v' = v + N(0, sigma^2) n_v, or in each of three directions. Connectivity is kept; the surface may
/// come to intersect itself when sigma is not small against its edges. To give sigma in mean edge lengths,
/// multiply by mean_edge_m(mesh). Same seed, same bytes. O(F).
TriangleMesh with_vertex_noise(const TriangleMesh& mesh, double sigma_m, NoiseDirection direction,
                               std::uint64_t seed);

}  // namespace geocage::geometry
