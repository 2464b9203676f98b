#include "physics/formula_field.h"

#include <cmath>

namespace geocage::physics {

geometry::SignedDistanceField filled(const geometry::Vec3& half, double cell_m,
                                     const std::function<double(const geometry::Vec3&)>& distance) {
  geometry::SignedDistanceField field;
  field.origin = -half, field.cell_m = cell_m;
  for (int axis = 0; axis < 3; ++axis)
    field.nodes[axis] = static_cast<int>(std::ceil(2 * half[axis] / cell_m)) + 1;
  for (int z = 0; z < field.nodes[2]; ++z)
    for (int y = 0; y < field.nodes[1]; ++y)
      for (int x = 0; x < field.nodes[0]; ++x)
        field.coarse.push_back(static_cast<float>(distance(field.origin + cell_m * geometry::Vec3(x, y, z))));
  std::size_t cells = 1;
  for (const int n : field.nodes) cells *= n - 1;
  field.block.assign(cells, 0);
  field.mark();
  return field;
}

}  // namespace geocage::physics
