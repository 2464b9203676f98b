#include "stages/scan/scan.h"

#include <cmath>

#include <gtest/gtest.h>
#include <omp.h>

#include "datasets/shapes.h"

namespace geocage::stages {
namespace {

using geometry::Vec3;

geometry::PointCloud seen(const ScanParams& params, const geometry::TriangleMesh& mesh) {
  pipeline::Run run;
  return scan(params, run, mesh);
}

// Facets of the icosphere lie inside it by at most edge^2 / (8 r) x 4/3; ranges are floats at 0.4 m: 3e-8 m.
TEST(Scan, WithoutNoisePointsLieOnTheSurface) {
  const double r = 0.05;
  const auto ball = datasets::icosphere(r, 5);
  const double edge = geometry::mean_edge_m(ball);
  const auto cloud = seen({.views = 3, .sigma_m = 0}, ball);
  EXPECT_GT(cloud.size(), 3000u);
  for (const Vec3& p : cloud.points) {
    EXPECT_LE(p.norm(), r + 1e-6);
    EXPECT_GE(p.norm(), r - edge * edge / (4 * r));
  }
}

// A facet's normal leans from the ball's by edge / (2 r) at most.
TEST(Scan, EachPointFacesItsSensor) {
  const auto ball = datasets::icosphere(0.05, 4);
  const double lean = geometry::mean_edge_m(ball) / (2 * 0.05);
  const auto cloud = seen({.views = 5, .sigma_m = 0}, ball);
  ASSERT_EQ(cloud.sensor_origins.size(), 5u);
  ASSERT_EQ(cloud.view.size(), cloud.size());
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const Vec3 to_sensor = cloud.sensor_origins[cloud.view[i]] - cloud.points[i];
    EXPECT_GT(cloud.points[i].normalized().dot(to_sensor.normalized()), -lean);
  }
}

// The mean of n squares of normal numbers has a relative deviation of sqrt(2 / n): 4 of these.
TEST(Scan, NoiseHasItsDeviation) {
  const double sigma = 0.001;
  const auto ball = datasets::icosphere(0.05, 5);
  for (const char* noise : {"ray", "isotropic"}) {
    const auto clean = seen({.views = 2, .sigma_m = 0}, ball),
               noisy = seen({.views = 2, .sigma_m = sigma, .noise = noise}, ball);
    ASSERT_EQ(clean.size(), noisy.size());
    double sum = 0;
    for (std::size_t i = 0; i < clean.size(); ++i) sum += (noisy.points[i] - clean.points[i]).squaredNorm();
    const double n = static_cast<double>(clean.size()) * (std::string(noise) == "ray" ? 1 : 3);
    EXPECT_NEAR(sum / n, sigma * sigma, 4 * std::sqrt(2 / n) * sigma * sigma) << noise;
  }
}

TEST(Scan, SameSeedSameBytesForAnyThreadCount) {
  const auto cup = datasets::cup(0.04, 0.1, 0.003, 48);
  omp_set_num_threads(1);
  const auto one = seen({.seed = 3}, cup);
  omp_set_num_threads(4);
  const auto four = seen({.seed = 3}, cup), other = seen({.seed = 4}, cup);
  EXPECT_EQ(one.points, four.points);
  EXPECT_EQ(one.view, four.view);
  EXPECT_NE(one.points, other.points);
}

}  // namespace
}  // namespace geocage::stages
