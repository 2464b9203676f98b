#pragma once
#include "geometry/cloud.h"

namespace geocage::stages {

/// The cloud with points added where nothing was seen, so that a closed surface ends there instead of
/// ballooning away:
/// - for a single view, on the border of what the sensor could not see: that counts as solid, down to the
/// farthest depth
///   that it saw and to the table. Holes that it saw through stay open.
/// - for several views of an object on a table, at the table under it, facing down.
/// Added points lie about `step_m` apart.
geometry::PointCloud closed_where_unseen(const geometry::PointCloud& cloud, double step_m);

}  // namespace geocage::stages
