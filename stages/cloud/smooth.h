#pragma once
#include "geometry/cloud.h"

namespace geocage::stages {

/// Points moved onto a surface of second order through their neighbours within `radius_m` (moving least
/// squares, Alexa et al. 2003, by PCL). Points with too few neighbours go; views and support are kept.
geometry::PointCloud smoothed(const geometry::PointCloud& cloud, double radius_m);

}  // namespace geocage::stages
