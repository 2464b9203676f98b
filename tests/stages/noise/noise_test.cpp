#include "stages/noise/noise.h"

#include <cmath>

#include <gtest/gtest.h>

#include "datasets/shapes.h"
#include "pipeline/error.h"

namespace geocage::stages {
namespace {

// Of n = 10242 vertices of a sphere moved along their normals the root mean square is sigma (1 +- 1 / sqrt(2
// n)): five deviations are 3.5 %.
TEST(Noise, MovesBySigmaAlongNormals) {
  const auto sphere = datasets::icosphere(0.05, 5);
  for (const NoiseParams& params : {NoiseParams{.sigma_edges = 0.2}, NoiseParams{.sigma_m = 0.0003}}) {
    pipeline::Run run;
    const auto noisy = noise(params, run, sphere);
    const double sigma_m = params.sigma_m > 0 ? params.sigma_m : 0.2 * geometry::mean_edge_m(sphere);
    EXPECT_DOUBLE_EQ(run.metrics().at("sigma_m"), sigma_m);
    EXPECT_NEAR(run.metrics().at("moved_rms_m"), sigma_m, 0.035 * sigma_m);
    EXPECT_EQ(noisy.triangles, sphere.triangles);
    double across = 0;
    for (std::size_t v = 0; v < sphere.vertices.size(); ++v) {
      const auto normal = sphere.vertices[v].normalized();
      const auto moved = noisy.vertices[v] - sphere.vertices[v];
      across = std::max(across, (moved - moved.dot(normal) * normal).norm());
    }
    // a triangle's normal differs by less than edge / (sqrt(3) r) = 0.022 from the radius at its corners, and
    // no vertex moves by more than 5 sigma
    EXPECT_LT(across, 0.11 * sigma_m);
  }
}

// Three directions: a displacement of root mean square sqrt(3) sigma, to 5 / sqrt(2 * 3 n) of it.
TEST(Noise, IsotropicMovesEveryWay) {
  const auto sphere = datasets::icosphere(0.05, 5);
  pipeline::Run run;
  noise({.sigma_m = 0.001, .direction = "isotropic"}, run, sphere);
  EXPECT_NEAR(run.metrics().at("moved_rms_m"), std::sqrt(3.0) * 0.001, 0.02 * std::sqrt(3.0) * 0.001);
}

TEST(Noise, NoneIsTheMeshAndSeedsDiffer) {
  const auto sphere = datasets::icosphere(0.05, 2);
  pipeline::Run run;
  EXPECT_EQ(noise({}, run, sphere).vertices, sphere.vertices);
  const auto one = noise({.sigma_edges = 0.1, .seed = 1}, run, sphere);
  EXPECT_EQ(noise({.sigma_edges = 0.1, .seed = 1}, run, sphere).vertices, one.vertices);
  EXPECT_NE(noise({.sigma_edges = 0.1, .seed = 2}, run, sphere).vertices, one.vertices);
}

TEST(Noise, RefusesTwoDeviations) {
  pipeline::Run run;
  EXPECT_THROW(noise({.sigma_edges = 0.1, .sigma_m = 0.001}, run, datasets::cube()), pipeline::UserError);
}

}  // namespace
}  // namespace geocage::stages
