#include "topology/flux.h"

#include <numbers>

#include <gtest/gtest.h>

#include "datasets/shapes.h"

namespace geocage::topology {
namespace {

constexpr double pi = std::numbers::pi;

TEST(TriangleFlux, OfAnOctantIsHalfPi) {
  const Vec3 x = Vec3::UnitX(), y = Vec3::UnitY(), z = Vec3::UnitZ();
  EXPECT_NEAR(triangle_flux_sr(Vec3::Zero(), x, y, z), pi / 2, 1e-15);
  EXPECT_NEAR(triangle_flux_sr(Vec3::Zero(), y, x, z), -pi / 2, 1e-15);
  EXPECT_EQ(triangle_flux_sr(x, x, y, z), 0);
}

TEST(SurfaceFlux, OfAClosedMeshIsAllInsideAndNothingOutside) {
  const auto mesh = datasets::torus(0.04, 0.015, 40, 24);
  EXPECT_NEAR(surface_flux_sr(Vec3(0.041, 0.003, 0.002), mesh), 4 * pi, 1e-10);
  EXPECT_NEAR(surface_flux_sr(Vec3(0, 0, 0.001), mesh), 0, 1e-10) << "in the hole";
  EXPECT_NEAR(surface_flux_sr(Vec3(0.3, -0.2, 0.1), mesh), 0, 1e-10);
}

TEST(FluxShare, OfASheetHasAClosedForm) {
  // A square plate of side 2 at height 1 over its middle: a sixth of all directions. The object is a ball so
  // small that its quadrature points all see the same.
  auto plate = datasets::flat_grid(2, 1);
  for (Vec3& p : plate.vertices) p.z() = 1;
  const auto dot = datasets::icosphere(1e-6, 1);
  EXPECT_NEAR(flux_share(dot, plate), 1 / 6.0, 1e-6);
  auto turned = plate;
  for (auto& t : turned.triangles) std::swap(t[0], t[1]);
  EXPECT_DOUBLE_EQ(flux_share(dot, turned), -flux_share(dot, plate));
  EXPECT_NEAR(flux_share(datasets::icosphere(0.05, 2), datasets::icosphere(0.1, 2)), 1, 1e-12) << "enclosed";
  auto large = datasets::icosphere(0.05, 2), around = plate;
  for (auto* mesh : {&large, &around})
    for (Vec3& p : mesh->vertices) p *= 7;
  EXPECT_NEAR(flux_share(large, around), flux_share(datasets::icosphere(0.05, 2), plate), 1e-12) << "scale";
}

}  // namespace
}  // namespace geocage::topology
