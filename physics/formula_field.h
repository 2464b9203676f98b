#pragma once
#include <functional>

#include "geometry/distance_field.h"

namespace geocage::physics {

/// A field whose nodes are filled from a formula, over the box [-half, half] of O, without fine blocks: the
/// known shapes of controls and tests. O(cells).
geometry::SignedDistanceField filled(const geometry::Vec3& half, double cell_m,
                                     const std::function<double(const geometry::Vec3&)>& distance);

}  // namespace geocage::physics
