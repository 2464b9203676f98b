#include "geometry/nearest_of_eight.h"

#include <cstring>
#include <random>

#include <gtest/gtest.h>

#include "datasets/shapes.h"
#include "geometry/distance_field.h"
#include "geometry/instruction_sets.h"

namespace geocage::geometry {
namespace {

/// Eight points side by side, `apart` of each other, somewhere within `reach` of the origin.
NearestOfEight::Points drawn(std::mt19937_64& random, double reach, double apart, int triangles) {
  std::uniform_real_distribution<> unit(-1, 1);
  NearestOfEight::Points eight{};
  const Vec3 first = reach * Vec3(unit(random), unit(random), unit(random));
  for (int k = 0; k < 8; ++k) {
    eight.points_O[k] = first + apart * Vec3(k & 1, k >> 1 & 1, k >> 2);
    eight.nearest[k] = static_cast<int>(random() % static_cast<std::size_t>(triangles));
  }
  return eight;
}

/// Triangles without area among others: one point, a line, a line with its middle.
TriangleMesh with_flat_ones() {
  auto mesh = datasets::torus(0.05, 0.012, 24, 12);
  const int n = static_cast<int>(mesh.vertices.size());
  for (const Vec3& p : {Vec3(0, 0, 0.03), Vec3(0.02, 0, 0.03), Vec3(0.01, 0, 0.03)})
    mesh.vertices.push_back(p);
  mesh.triangles.push_back({n, n, n});
  mesh.triangles.push_back({n, n + 1, n + 1});
  mesh.triangles.push_back({n + 2, n, n + 1});
  return mesh;
}

TEST(NearestOfEight, AgreesWithBruteForce) {
  for (const auto& mesh :
       {datasets::icosphere(0.05, 3), datasets::box({0.06, 0.08, 0.002}, 1), with_flat_ones()}) {
    const NearestOfEight search(mesh);
    std::mt19937_64 random(1);
    for (int i = 0; i < 300; ++i) {
      auto eight = drawn(random, 0.1, i % 2 ? 0.002 : 0.05, static_cast<int>(mesh.triangles.size()));
      search.measure(eight);
      for (int k = 0; k < 8; ++k) {
        const Vec3& p = eight.points_O[k];
        // Lengths of at most 0.3 m in double: a few roundings of 3e-17 m, squared and rooted again near 0.
        EXPECT_NEAR(eight.distance_m[k], brute_force_distance_m(mesh, p), 1e-14) << p.transpose();
        const auto& t = mesh.triangles[eight.nearest[k]];
        const Vec3 q =
            closest_point_on_triangle(p, mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]);
        EXPECT_NEAR((p - q).norm(), eight.distance_m[k], 1e-14);
      }
    }
  }
}

TEST(NearestOfEight, OneTriangleIsEnough) {
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  mesh.triangles = {{0, 1, 2}};
  NearestOfEight::Points eight{};
  eight.points_O.fill({0.25, 0.25, 3});
  NearestOfEight(mesh).measure(eight);
  EXPECT_NEAR(eight.distance_m[7], 3, 1e-14);
}

TEST(NearestOfEight, SameBitsForEveryInstructionSet) {
  const auto mesh = with_flat_ones();
  const NearestOfEight search(mesh);
  const char* names[8];
  const int sets = instruction_sets(names, 8);
  ASSERT_GE(sets, 1);
  std::mt19937_64 random(2);
  for (int i = 0; i < 200; ++i) {
    const auto asked = drawn(random, 0.1, 0.002, static_cast<int>(mesh.triangles.size()));
    auto wanted = asked;
    search.measure(wanted);
    for (int s = 0; s < sets; ++s) {
      force_instruction_set(names[s]);
      auto got = asked;
      search.measure(got);
      EXPECT_EQ(std::memcmp(&got.distance_m, &wanted.distance_m, sizeof got.distance_m), 0) << names[s];
      EXPECT_EQ(got.nearest, wanted.nearest) << names[s];
    }
    force_instruction_set("");
  }
}

}  // namespace
}  // namespace geocage::geometry
