#include "topology/winding_number.h"

#include <gtest/gtest.h>

#include "tests/topology/curves.h"

namespace geocage::topology {
namespace {

TEST(WindingNumber, Turns) {
  const Vec3 center(0, 0, 3), normal = Vec3::UnitZ();  // heights don't count
  const auto twice = closed_polyline(14, [](double t) { return Vec3(std::cos(2 * t), std::sin(2 * t), t); });
  EXPECT_NEAR(winding_number(ring(7), center, normal), 1, 1e-14);
  EXPECT_NEAR(winding_number(ring(7), center, normal, Turning::is_unsigned), 1, 1e-14);
  EXPECT_NEAR(winding_number(twice, center, normal), 2, 1e-14);
  EXPECT_NEAR(winding_number(reversed(ring(7)), center, normal), -1, 1e-14);
  EXPECT_NEAR(winding_number(reversed(ring(7)), center, normal, Turning::is_unsigned), 1, 1e-14);
}

TEST(WindingNumber, CentreOutside) {
  const Vec3 center(2, 0, 0);
  EXPECT_NEAR(winding_number(ring(4096), center, Vec3::UnitZ()), 0, 1e-13);
  // There and back over the angle between the tangents, 2 asin(1/2): 4 asin(1/2) / (2 pi) = 1/3. The
  // polygon's silhouette misses the tangent points by at most half a side, second order in the angle.
  EXPECT_NEAR(winding_number(ring(4096), center, Vec3::UnitZ(), Turning::is_unsigned), 1.0 / 3, 1e-5);
}

TEST(WindingNumber, CoarsestClosedPolygonsTurnOnce) {
  for (int m : {3, 4, 5, 12})
    EXPECT_NEAR(winding_number(ring(m), Vec3::Zero(), Vec3::UnitZ()), 1, 1e-14) << m;
}

TEST(WindingNumber, RigidMotionsAndScalesChangeNothing) {
  std::mt19937_64 random(5);
  const geometry::Pose X(Eigen::Translation3d(0.3, -0.2, 0.1) *
                         Eigen::AngleAxisd(0.7, Vec3(1, 2, 3).normalized()));
  const auto chain = random_chain(random, 20);
  Polyline moved;
  for (const Vec3& p : chain) moved.push_back(X * (3 * p));
  const Vec3 center(0.1, 0.2, 0.3), normal = Vec3(1, -1, 2).normalized();
  EXPECT_NEAR(winding_number(moved, X * (3 * center), X.linear() * normal),
              winding_number(chain, center, normal), 1e-13);
}

// Central differences with step h: their error is h^2 / 6 times the third derivative, 2 / d^3 / (2 pi) at the
// distance d >= 0.05 of a point from the axis: 4e-10 at h = 1e-6, and rounding gives 1e-16 / h = 1e-10.
TEST(WindingNumber, GradientIsThatOfDifferences) {
  std::mt19937_64 random(1);
  const double h = 1e-6;
  int checked = 0;
  for (int i = 0; i < 1000; ++i)
    for (Turning turning : {Turning::is_signed, Turning::is_unsigned}) {
      auto chain = random_chain(random, 5);
      const Vec3 center = random_point(random), normal = random_point(random).normalized();
      const auto value = [&] { return winding_number(chain, center, normal, turning); };
      if (std::any_of(chain.begin(), chain.end(),
                      [&](const Vec3& p) { return (p - center).cross(normal).norm() < 0.05; }))
        continue;
      const double before = value();
      std::vector<Vec3> gradient;
      EXPECT_EQ(winding_number(chain, center, normal, turning, gradient), before);
      for (std::size_t k = 0; k < chain.size(); ++k)
        for (int axis = 0; axis < 3; ++axis) {
          const double at = chain[k][axis];
          chain[k][axis] = at + h;
          const double more = value();
          chain[k][axis] = at - h;
          const double less = value();
          chain[k][axis] = at;
          if (std::abs(more - less) > 0.1) continue;  // a step of half a turn jumped between them
          EXPECT_NEAR(gradient[k][axis], (more - less) / (2 * h), 3e-9);
          ++checked;
        }
    }
  EXPECT_GT(checked, 20000);
}

TEST(WindingNumber, GradientIsCappedAtTheCentre) {
  std::vector<Vec3> gradient;
  const Polyline chain = {{1e-9, 0, 0}, {1, 1, 0}};
  winding_number(chain, Vec3::Zero(), Vec3::UnitZ(), Turning::is_signed, gradient, 100);
  EXPECT_NEAR(gradient[0].norm(), 100, 1e-9);
  EXPECT_LT(gradient[0].y(), 0);  // a start that moves to +y takes from the angle towards (1, 1)
  EXPECT_EQ(winding_number({{0, 0, 0}, {1, 1, 0}}, Vec3::Zero(), Vec3::UnitZ(), Turning::is_signed, gradient),
            0);
  EXPECT_EQ(gradient[0], Vec3::Zero());
}

}  // namespace
}  // namespace geocage::topology
