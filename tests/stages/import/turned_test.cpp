#include "stages/import/turned.h"

#include <cmath>

#include <gtest/gtest.h>

namespace geocage::stages {
namespace {

using geometry::Vec3;

/// The half towards the origin of what turns about an upright axis, radius a function of height.
template <class Radius>
std::vector<Vec3> half_seen(const geometry::Plane& table, const Eigen::Vector2d& axis_m,
                            const Radius& radius) {
  const Eigen::Matrix3d frame = geometry::frame_from_z(table.normal);
  const double towards = std::atan2(-axis_m.y(), -axis_m.x());
  std::vector<Vec3> points;
  for (int k = 0; k < 40; ++k)
    for (int i = 0; i < 37; ++i) {
      const double z = 0.003 * k, turn = towards + M_PI * (i - 18) / 40;
      const Eigen::Vector2d at = axis_m + radius(z) * Eigen::Vector2d(std::cos(turn), std::sin(turn));
      points.emplace_back(frame * Vec3(at.x(), at.y(), z));
    }
  return points;
}

const geometry::Plane table{Vec3(0.1, -0.7, 0.6).normalized(), -0.8};
const Eigen::Vector2d axis_m(0.5, -0.3);

// Within a slice of 6 mm a radius that changes by 0.3 a metre is off by 0.9 mm at most, and the axis no more.
TEST(Turned, FindsTheAxisOfWhatTurnsFromHalfOfIt) {
  const auto can = turned_about(half_seen(table, axis_m, [](double) { return 0.04; }), table);
  EXPECT_LT((can.axis_m - axis_m).norm(), 1e-5);  // where steps end
  EXPECT_LT(can.off_m, 1e-5);
  const auto cone = turned_about(half_seen(table, axis_m, [](double z) { return 0.06 - 0.3 * z; }), table);
  EXPECT_LT((cone.axis_m - axis_m).norm(), 0.0009);
  EXPECT_LT(cone.off_m, 0.0009);
}

// Two walls of 80 mm have no axis: even about the middle of their square radii go from 40 to 57 mm, 5 mm of
// deviation, of which less than half is asked.
TEST(Turned, ABoxDoesNot) {
  const Eigen::Matrix3d frame = geometry::frame_from_z(table.normal);
  std::vector<Vec3> points;
  for (int k = 0; k < 40; ++k)
    for (int i = 0; i <= 40; ++i) {
      points.emplace_back(frame * Vec3(0.5 - 0.002 * i, 0.2, 0.003 * k));
      points.emplace_back(frame * Vec3(0.5, 0.2 + 0.002 * i, 0.003 * k));
    }
  EXPECT_GT(turned_about(points, table).off_m, 0.002);
}

}  // namespace
}  // namespace geocage::stages
