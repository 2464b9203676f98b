#pragma once
#include <functional>

#include "geometry/distance_field.h"

namespace geocage::tests {

/// A field of one coarse grid that samples the distance function `distance` over the box low..high.
inline geometry::SignedDistanceField sampled_field(
    const std::function<double(const geometry::Vec3&)>& distance, const geometry::Vec3& low,
    const geometry::Vec3& high, double cell_m) {
  geometry::SignedDistanceField field;
  field.origin = low;
  field.cell_m = cell_m;
  for (int i = 0; i < 3; ++i) field.nodes[i] = 1 + static_cast<int>(std::ceil((high - low)[i] / cell_m));
  for (int z = 0; z < field.nodes[2]; ++z)
    for (int y = 0; y < field.nodes[1]; ++y)
      for (int x = 0; x < field.nodes[0]; ++x)
        field.coarse.push_back(static_cast<float>(distance(low + cell_m * geometry::Vec3(x, y, z))));
  field.block.assign(
      static_cast<std::size_t>((field.nodes[0] - 1) * (field.nodes[1] - 1) * (field.nodes[2] - 1)), 0);
  field.mark();
  return field;
}

/// Signed distance to the box |p - center| <= half, exact outside and inside.
inline double box_distance(const geometry::Vec3& p, const geometry::Vec3& half) {
  const geometry::Vec3 q = p.cwiseAbs() - half;
  return q.cwiseMax(0).norm() + std::min(0.0, q.maxCoeff());
}

}  // namespace geocage::tests
