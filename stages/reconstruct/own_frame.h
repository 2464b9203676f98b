#pragma once
#include <vector>

#include "geometry/pose.h"

namespace geocage::stages {

/// X_CO: into a cloud's own frame C, which turns with the points, so that what is made in C doesn't hang on
/// how the cloud was turned. Principal axes, each towards its longer tail (third moment), then a fixed turn
/// that keeps a symmetric cloud's points off the borders of cells. Principal moments nearer to each other
/// than 2 % of the largest tell no direction and tails of a skewness below 0.02 no sense: there O's axes do,
/// so that vanishing noise changes nothing. Precondition: points.
geometry::Pose own_frame(const std::vector<geometry::Vec3>& points);

}  // namespace geocage::stages
