#pragma once
#include "geometry/cloud.h"

namespace geocage::stages {

/// The cloud with points added where nothing was seen, so that a closed surface ends there instead of
/// ballooning away:
/// - for a single view, on the border of what the sensor could not see: that counts as solid, down to the
///   farthest depth that it saw and to the table. Holes that it saw through stay open.
/// - for several views, at the table under the object, facing down; and, if `open_cavities`, between what
/// their
///   rays passed and what none of them reached, so that what they looked into (a cup) stays open as far as
///   they saw.
/// Added points lie about `step_m` apart.
geometry::PointCloud closed_where_unseen(const geometry::PointCloud& cloud, double step_m,
                                         bool open_cavities);

}  // namespace geocage::stages
