#pragma once
#include "topology/polyline.h"

namespace geocage::topology {

/// How often one closed curve goes through another.
struct LinkingNumber {
  int value = 0;
  double residual = 0;  ///< of the sum from `value`: rounding alone, about 1e-15 a pair of segments; curves
                        ///< that touch have no linking number, and leave a large one
};

/// Of two closed polylines, whose last points are joined to their first ones (thesis eq. 2.1). A hand whose
/// links close a loop is caged by an object's handle when this is not 0: neither can leave without a cut.
/// O(n m). Precondition: two points each at least.
LinkingNumber linking_number(const Polyline& first, const Polyline& second);

}  // namespace geocage::topology
