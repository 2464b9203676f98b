#pragma once
#include <filesystem>
#include <vector>

#include <Eigen/Core>

#include "geometry/pose.h"

namespace geocage::topology {

using geometry::Vec3;
using Polyline = std::vector<Vec3>;

/// Signed solid angle [sr] under which the segments ab and cd see each other, in [-2 pi, 2 pi]: the double
/// integral of Gauss over the two segments (thesis eq. 3.1, in the arctangent form that needs no clamp). 0
/// for segments that are parallel, share an end, or have no length. Jumps by 4 pi where the segments cross.
double segment_writhe(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d);

/// Omega_ij [sr] of segment i of `first` and j of `second`, (n-1) x (m-1). O(n m).
/// Precondition: at least two points each.
Eigen::MatrixXd writhe_matrix(const Polyline& first, const Polyline& second);

/// Sum of the writhe matrix over 4 pi (thesis eq. 2.1): the linking number of two closed curves.
double gauss_linking_integral(const Polyline& first, const Polyline& second);

/// Writhe of one closed polyline (last point joined to the first): sum over i != j of Omega_ij / 4 pi.
double writhe_of_closed(const Polyline& curve);

enum class Turning { is_signed, is_unsigned };

/// Turns of a polyline around `center` in the plane with the unit `normal`. Unsigned is thesis eq. 3.13:
/// there and back adds up. Precondition: no point at the centre.
double winding_number(const Polyline& curve, const Vec3& center, const Vec3& normal,
                      Turning turning = Turning::is_signed);

/// One "x,y,z" a line, metres. UserError (input) naming file and line: not three finite numbers, fewer than
/// two points.
Polyline read_polyline(const std::filesystem::path& file);

}  // namespace geocage::topology
