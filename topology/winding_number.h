#pragma once
#include "topology/polyline.h"

namespace geocage::topology {

enum class Turning { is_signed, is_unsigned };

/// Turns of a polyline around `center` in the plane with the unit `normal` (thesis 3.2). Unsigned is thesis
/// eq. 3.13: there and back adds up. A point at the centre has no direction: its two steps count nothing.
double winding_number(const Polyline& curve, const Vec3& center, const Vec3& normal,
                      Turning turning = Turning::is_signed);

/// The same, and its derivatives by the curve's points [1/m], each in the plane; minus their sum is that by
/// the centre. They grow like 1 / distance from the centre: each of a step's two parts is at most
/// `most_gradient_1pm` long. Unsigned has a kink where a step turns by nothing: 0 is taken there. Allocates
/// only when `gradient` is shorter than the curve. O(n).
double winding_number(const Polyline& curve, const Vec3& center, const Vec3& normal, Turning turning,
                      std::vector<Vec3>& gradient, double most_gradient_1pm = 1e4);

}  // namespace geocage::topology
