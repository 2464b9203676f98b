#include "stages/cloud/cloud.h"

#include <cmath>

#include <gtest/gtest.h>

#include "datasets/shapes.h"
#include "pipeline/error.h"

namespace geocage::stages {
namespace {

using geometry::PointCloud;
using geometry::Vec3;

/// What two far sensors see of a ball of 50 mm, each its half; or all of it without sensors.
PointCloud ball(bool sensors) {
  PointCloud cloud;
  cloud.points = datasets::icosphere(0.05, 5).vertices;
  if (!sensors) return cloud;
  // From 5 m a point is seen when |x| > r^2 / 5 m = 0.5 mm.
  std::erase_if(cloud.points, [](const Vec3& p) { return std::abs(p.x()) < 0.001; });
  cloud.sensor_origins = {{5, 0, 0}, {-5, 0, 0}};
  for (const Vec3& p : cloud.points) cloud.view.push_back(p.x() < 0);
  return cloud;
}

// 24 neighbours span about 6 mm of a ball of 50 mm: a plane fits to an angle of 3/50 at most at the border of
// a view.
TEST(Cloud, NormalsPointOutward) {
  for (bool sensors : {true, false}) {
    pipeline::Run run;
    const auto clean = cloud({}, run, ball(sensors));
    ASSERT_EQ(clean.normals.size(), clean.size());
    for (std::size_t i = 0; i < clean.size(); ++i) {
      EXPECT_NEAR(clean.normals[i].norm(), 1, 1e-6);
      EXPECT_GT(clean.normals[i].dot(clean.points[i].normalized()), 0.99);
    }
    EXPECT_EQ(run.metrics().at("oriented_by_sensor"), sensors);
  }
}

TEST(Cloud, OutliersGoAndEveryPointIsAccountedFor) {
  auto raw = ball(false);
  const std::size_t good = raw.size();
  for (int i = 0; i < 20; ++i)
    raw.points.emplace_back(0.1 + 0.02 * i, 0.1 * std::sin(i), 0.1 * std::cos(2 * i));
  pipeline::Run run;
  const auto clean = cloud({}, run, raw);
  const auto& m = run.metrics();
  EXPECT_GE(m.at("outliers"), 20);
  EXPECT_LT(m.at("outliers"), 20 + 0.02 * static_cast<double>(good));
  EXPECT_EQ(m.at("points_in"), m.at("outliers") + m.at("thinned") + m.at("points"));
  for (const Vec3& p : clean.points) EXPECT_LT(p.norm(), 0.06);
}

TEST(Cloud, ThinsToTheVoxelAndKeepsViewsAndSupport) {
  auto raw = ball(true);
  raw.support = geometry::Plane{Vec3::UnitZ(), -0.05};
  pipeline::Run run;
  const auto coarse = cloud({.voxel_m = 0.008}, run, raw), fine = cloud({.voxel_m = 0.004}, run, raw);
  // Area over voxel area: a fourth of the points, loosely because voxels cut the surface at all angles.
  EXPECT_NEAR(static_cast<double>(fine.size()) / static_cast<double>(coarse.size()), 4, 0.8);
  EXPECT_EQ(fine.view.size(), fine.size());
  EXPECT_TRUE(fine.support);
  EXPECT_EQ(fine.sensor_origins, raw.sensor_origins);
}

TEST(Cloud, TooFewPointsAreRefused) {
  pipeline::Run run;
  EXPECT_THROW(cloud({.voxel_m = 0.05}, run, ball(false)), pipeline::UserError);
}

}  // namespace
}  // namespace geocage::stages
