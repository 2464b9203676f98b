#include "geometry/noise.h"

#include <cmath>

#include <gtest/gtest.h>

#include "datasets/shapes.h"

namespace geocage::geometry {
namespace {

// Of n numbers the mean has the deviation 1 / sqrt n, the mean square sqrt(2 / n), the mean fourth power
// sqrt(96 / n): 4 of each.
TEST(Noise, NumbersAreNormal) {
  RandomStream random(3, 7);
  const int n = 100000;
  double m1 = 0, m2 = 0, m4 = 0;
  for (int i = 0; i < n; ++i) {
    const double x = random.normal();
    m1 += x / n;
    m2 += x * x / n;
    m4 += x * x * x * x / n;
  }
  EXPECT_NEAR(m1, 0, 4 / std::sqrt(n));
  EXPECT_NEAR(m2, 1, 4 * std::sqrt(2.0 / n));
  EXPECT_NEAR(m4, 3, 4 * std::sqrt(96.0 / n));
}

TEST(Noise, StreamsDifferAndRepeat) {
  RandomStream a(1, 2), again(1, 2), other(1, 3);
  const Vec3 x = a.normal_vector();
  EXPECT_EQ(x, again.normal_vector());
  EXPECT_NE(x, other.normal_vector());
  EXPECT_NEAR(a.direction().norm(), 1, 1e-15);
}

TEST(Noise, MovesVerticesByItsDeviationAndKeepsTheTriangles) {
  const auto ball = datasets::icosphere(0.05, 5);
  const double sigma = 0.2 * mean_edge_m(ball);
  const auto n = static_cast<double>(ball.vertices.size());
  for (const auto direction : {NoiseDirection::normal, NoiseDirection::isotropic}) {
    const auto noisy = with_vertex_noise(ball, sigma, direction, 4);
    EXPECT_EQ(noisy.triangles, ball.triangles);
    double sum = 0, aside = 0;
    for (std::size_t v = 0; v < ball.vertices.size(); ++v) {
      const Vec3 move = noisy.vertices[v] - ball.vertices[v], out = ball.vertices[v].normalized();
      sum += move.squaredNorm();
      aside += (move - move.dot(out) * out).squaredNorm();
    }
    const double numbers = direction == NoiseDirection::normal ? n : 3 * n;
    EXPECT_NEAR(sum / numbers, sigma * sigma, 4 * std::sqrt(2 / numbers) * sigma * sigma);
    // An icosphere's vertex normals lean by less than 1 degree; an isotropic move has two thirds aside.
    EXPECT_NEAR(aside / sum, direction == NoiseDirection::normal ? 0 : 2.0 / 3, 0.02);
  }
  EXPECT_EQ(with_vertex_noise(ball, 0, NoiseDirection::normal, 4).vertices, ball.vertices);
  EXPECT_NE(with_vertex_noise(ball, sigma, NoiseDirection::normal, 4).vertices,
            with_vertex_noise(ball, sigma, NoiseDirection::normal, 5).vertices);
}

}  // namespace
}  // namespace geocage::geometry
