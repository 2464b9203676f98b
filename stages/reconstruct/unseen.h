#pragma once
#include "geometry/cloud.h"

namespace geocage::stages {

/// The cloud with points added where nothing was seen, so that a closed surface ends there instead of
/// ballooning away:
/// - under an object on a table, at the table, facing down;
/// - for a single view, behind each seen point, facing away: what the sensor could not see counts as solid,
/// down to the
///   farthest depth that it saw and to the table.
/// Added points lie about `step_m` apart.
geometry::PointCloud closed_where_unseen(const geometry::PointCloud& cloud, double step_m);

}  // namespace geocage::stages
