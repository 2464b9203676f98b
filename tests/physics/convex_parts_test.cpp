#include "physics/convex_parts.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "datasets/shapes.h"
#include "tests/physics/scenes.h"

namespace geocage::physics {
namespace {

Eigen::AlignedBox3d box_of(const geometry::TriangleMesh& mesh) {
  Eigen::AlignedBox3d box;
  for (const Vec3& p : mesh.vertices) box.extend(p);
  return box;
}

// A ball has the Euler characteristic 1, a ring 0, a hollow ball 2 (half of its two spheres' 4), two balls 2
// in two pieces.
TEST(VoxelShape, counts_handles_hollows_and_pieces) {
  const Eigen::AlignedBox3d box(Vec3::Constant(-0.07), Vec3::Constant(0.07));
  const auto shape = [&](auto&& inside) { return voxel_shape(box, 0.002, inside); };
  const VoxelShape ball = shape([](const Vec3& p) { return p.norm() < 0.04; });
  EXPECT_EQ(ball.euler, 1);
  EXPECT_EQ(ball.pieces, 1);
  // The cubes' volume errs by about the surface's roundings: sqrt(area / cell^2) cells, 0.3 %; 2 % is ample.
  EXPECT_NEAR(ball.volume_m3, 4.0 / 3 * M_PI * 6.4e-5, 0.02 * 2.7e-4);
  EXPECT_EQ(shape([](const Vec3& p) { return torus_distance(p, 0.05, 0.01) < 0; }).euler, 0);
  EXPECT_EQ(shape([](const Vec3& p) { return p.norm() < 0.04 && p.norm() > 0.02; }).euler, 2);
  const VoxelShape two = shape([](const Vec3& p) { return (p.cwiseAbs() - Vec3(0.04, 0, 0)).norm() < 0.02; });
  EXPECT_EQ(two.euler, 2);
  EXPECT_EQ(two.pieces, 2);
}

struct Shape {
  const char* name;
  geometry::TriangleMesh mesh;
  long euler;  ///< of the solid
};

std::vector<Shape> shapes() {
  return {{"torus", datasets::torus(0.04, 0.01, 64, 24), 0},
          {"cup", datasets::cup(0.03, 0.06, 0.004, 48), 1},
          {"two handles", datasets::double_torus(0.03, 0.008, 64, 24), -1}};
}

// The field, and the convex parts, have the holes that the mesh has: half of the surface's V - E + F.
TEST(ConvexParts, and_field_keep_the_genus) {
  for (const Shape& shape : shapes()) {
    const auto field = geometry::build_distance_field(shape.mesh, {.cells = 48, .pad_m = 0.02, .refine = 3});
    const long vertices = static_cast<long>(shape.mesh.vertices.size()),
               triangles = static_cast<long>(shape.mesh.triangles.size());
    ASSERT_EQ(vertices - triangles / 2, 2 * shape.euler) << shape.name;  // closed: E = 3 F / 2
    const VoxelShape of_field =
        voxel_shape(box_of(shape.mesh), 1e-3, [&](const Vec3& p) { return field.value(p) < 0; });
    EXPECT_EQ(of_field.euler, shape.euler) << shape.name;
    EXPECT_EQ(of_field.pieces, 1) << shape.name;

    const ConvexPartsRule rule;
    const auto parts = convex_parts(shape.mesh, field, rule);
    const VoxelShape of_parts = voxel_shape(box_of(shape.mesh), 1e-3, parts);
    EXPECT_EQ(of_parts.euler, shape.euler) << shape.name << ", " << parts.size() << " parts";
    EXPECT_EQ(of_parts.pieces, 1) << shape.name;
  }
}

/// A ring of a tube of radius r, open by a gap along its middle circle of radius R.
geometry::TriangleMesh split_ring(double R, double r, double gap_m) {
  constexpr int around = 64, across = 16;
  geometry::TriangleMesh mesh;
  const double whole = 2 * M_PI - gap_m / R;
  for (int i = 0; i <= around; ++i)
    for (int j = 0; j < across; ++j) {
      const double u = whole * i / around, v = 2 * M_PI * j / across, d = R + r * std::cos(v);
      mesh.vertices.emplace_back(d * std::cos(u), d * std::sin(u), r * std::sin(v));
    }
  for (const double u : {0.0, whole}) mesh.vertices.emplace_back(R * std::cos(u), R * std::sin(u), 0);
  const int ends = (around + 1) * across;
  for (int j = 0; j < across; ++j) {
    const int k = (j + 1) % across;
    for (int i = 0; i < around; ++i) {
      const int a = i * across;
      mesh.triangles.push_back({a + j, a + across + j, a + across + k});
      mesh.triangles.push_back({a + j, a + across + k, a + k});
    }
    mesh.triangles.push_back({ends, j, k});
    mesh.triangles.push_back({ends + 1, around * across + k, around * across + j});
  }
  return mesh;
}

// A ring that is open by 0.9 mm is a ball to topology; parts within 1.5 mm close it, and finer ones don't.
TEST(ConvexParts, keep_a_gap_open_that_is_narrower_than_their_tolerance) {
  const auto mesh = split_ring(0.02, 0.005, 0.9e-3);
  ASSERT_GT(geometry::mass_properties(mesh).volume_m3, 0);
  const auto field = geometry::build_distance_field(mesh, {.cells = 48, .pad_m = 0.02, .refine = 3});
  EXPECT_EQ(voxel_shape(box_of(mesh), 4e-4, convex_parts(mesh, field, parts_within(1.5e-3))).euler, 0);
  const FaithfulParts found = faithful_parts(mesh, field, 1.5e-3, 4e-4);
  EXPECT_TRUE(found.faithful);
  EXPECT_LT(found.tolerance_m, 1.5e-3);
  EXPECT_EQ(voxel_shape(box_of(mesh), 4e-4, found.parts).euler, 1);
}

// No point of a part is outside by more than the tolerance and the field's own error (0.25 mm asked), and no
// point that is 0.5 mm inside is left out.
TEST(ConvexParts, stay_close_to_the_solid_and_cover_it) {
  const double R = 0.04, r = 0.01;
  const auto mesh = datasets::torus(R, r, 96, 48);
  const auto field = geometry::build_distance_field(mesh, {.cells = 48, .pad_m = 0.02, .refine = 3});
  const ConvexPartsRule rule;
  const auto parts = convex_parts(mesh, field, rule);
  std::mt19937_64 random(1);
  std::uniform_real_distribution<> unit(-1, 1);
  int inside = 0;
  for (int i = 0; i < 100000; ++i) {
    const Vec3 p(0.055 * unit(random), 0.055 * unit(random), 0.015 * unit(random));
    bool covered = false;
    for (const ConvexPart& part : parts) covered |= part.contains(p, 1e-9);
    const double distance = torus_distance(p, R, r);
    inside += covered;
    if (covered) {
      EXPECT_LT(distance, rule.tolerance_m + 2.5e-4);
    }
    if (distance < -5e-4) {
      EXPECT_TRUE(covered) << p.transpose();
    }
  }
  EXPECT_GT(inside, 1000);
  EXPECT_LT(parts.size(), 100u);
}

// A convex solid is one part, with its own volume.
TEST(ConvexParts, of_a_box_are_the_box) {
  const auto mesh = datasets::box(Vec3(0.04, 0.03, 0.05));
  const auto field = geometry::build_distance_field(mesh, {.cells = 32, .pad_m = 0.02, .refine = 2});
  const auto parts = convex_parts(mesh, field, {});
  ASSERT_EQ(parts.size(), 1u);
  EXPECT_TRUE(parts[0].contains(box_of(mesh).center()));
  EXPECT_FALSE(parts[0].contains(box_of(mesh).max() + Vec3(1e-4, 0, 0)));
}

}  // namespace
}  // namespace geocage::physics
