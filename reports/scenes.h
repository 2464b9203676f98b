#pragma once
#include <vector>

#include "hands/grasp.h"
#include "reports/picture.h"

namespace geocage::reports {

/// A mesh coloured by a value a vertex.
Part coloured_surface(const TriangleMesh& mesh, const std::vector<double>& values, const Scale& scale);
/// Points within `radius_m` of the segment a-b, in one colour.
Part capsule_part(const Vec3& a, const Vec3& b, double radius_m, const Colour& colour);
/// A little ball at each place.
Part ball_part(const std::vector<Vec3>& centers, double radius_m, const Colour& colour);
/// Scan points as small squares that face along their normals (up, where there are none), with a colour a
/// point.
Part point_part(const std::vector<Vec3>& points, const std::vector<Vec3>& normals, double size_m,
                const std::vector<Colour>& colours);
/// The hand's capsules at X_OH with posture `q`: dark palm, light fingers.
Part hand_part(const hands::Hand& hand, const geometry::Pose& X_OH, const Eigen::VectorXd& q);

/// Of directions around `up`, the one from which the parts hide each other least: the product of what each
/// shows, relative to the best of all directions.
View clearest_view(const Studio& studio, const Vec3& up);

}  // namespace geocage::reports
