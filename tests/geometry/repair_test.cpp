#include "geometry/repair.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "datasets/shapes.h"
#include "geometry/crossings.h"
#include "geometry/distance_field.h"
#include "geometry/holes.h"
#include "geometry/surface_distance.h"

namespace geocage::geometry {
namespace {

void expect_repaired(const TriangleMesh& mesh, int euler, double volume_m3, double tolerance_m3) {
  const Repair repair = repair_mesh(mesh);
  EXPECT_EQ(repair.outcome, RepairOutcome::repaired) << repair.reason;
  const MeshReport report = check_mesh(repair.mesh);
  EXPECT_EQ(flaw_of_solid(repair.mesh), "");
  EXPECT_EQ(report.euler, euler);
  EXPECT_NEAR(report.volume_m3, volume_m3, tolerance_m3);
}

double volume(const TriangleMesh& mesh) {
  return check_mesh(mesh).volume_m3;
}

TEST(Repair, WhatIsFineStaysBitByBit) {
  auto mesh = datasets::cup(0.04, 0.1, 0.003, 24);
  mesh.observed.assign(mesh.vertices.size(), 0.3);
  const Repair repair = repair_mesh(mesh);
  EXPECT_EQ(repair.outcome, RepairOutcome::untouched);
  EXPECT_EQ(repair.mesh.vertices, mesh.vertices);
  EXPECT_EQ(repair.mesh.triangles, mesh.triangles);
  EXPECT_EQ(repair.mesh.observed, mesh.observed);
}

// A cube without one of its faces: the lid is flat, so the volume is that of the cube to rounding.
TEST(Repair, LidOfABoxIsFlat) {
  auto open = datasets::box({0.1, 0.1, 0.1}, 4);
  std::erase_if(open.triangles, [&](const auto& t) {
    for (int v : t)
      if (open.vertices[v].x() < 0.0499) return false;
    return true;
  });
  expect_repaired(open, 2, 1e-3, 1e-12);
  const Repair repair = repair_mesh(open);
  EXPECT_EQ(repair.counts.holes, 1);
  EXPECT_LT(repair.lost_m, 1e-12);  // what was there is there
  EXPECT_GE(repair.added_m + repair.sampling_m, 0.05);
  EXPECT_NE(repair.reason.find("not closed"), std::string::npos);
  EXPECT_FALSE(repair.triangles.empty());
}

TEST(Repair, TurnsEveryTriangleOutward) {
  auto mesh = datasets::torus(0.04, 0.012, 24, 12);
  const double v = volume(mesh);
  for (std::size_t f = 0; f < mesh.triangles.size(); f += 3)
    std::swap(mesh.triangles[f][0], mesh.triangles[f][1]);
  expect_repaired(mesh, 0, v, 1e-12);
  EXPECT_EQ(repair_mesh(mesh).counts.turned, static_cast<int>((mesh.triangles.size() + 2) / 3));
  for (auto& t : mesh.triangles) std::swap(t[1], t[2]);
  expect_repaired(mesh, 0, v, 1e-12);
}

TEST(Repair, UnweldedTrianglesBecomeOneSurface) {
  const auto torus = datasets::torus(0.04, 0.012, 24, 12);
  TriangleMesh loose;
  for (auto t : torus.triangles) {
    for (int& v : t) {
      loose.vertices.push_back(torus.vertices[v]);
      v = static_cast<int>(loose.vertices.size()) - 1;
    }
    loose.triangles.push_back(t);
  }
  expect_repaired(loose, 0, volume(torus), 1e-12);
  EXPECT_EQ(repair_mesh(loose).counts.welded,
            static_cast<int>(3 * torus.triangles.size() - torus.vertices.size()));
}

TEST(Repair, VertexOnASideIsPutIntoIt) {
  auto mesh = datasets::box({0.1, 0.2, 0.3}, 2);
  const auto [a, b, c] = mesh.triangles[5];
  mesh.vertices.push_back((mesh.vertices[a] + mesh.vertices[b]) / 2);
  const int m = static_cast<int>(mesh.vertices.size()) - 1;
  mesh.triangles[5] = {a, m, c};
  mesh.triangles.push_back({m, b, c});
  expect_repaired(mesh, 2, 0.006, 1e-12);
  EXPECT_EQ(repair_mesh(mesh).counts.t_junctions, 1);
  EXPECT_EQ(repair_mesh(mesh).counts.holes, 0);
}

TEST(Repair, FinsWallsAndDebrisGo) {
  auto mesh = datasets::icosphere(0.05, 3);
  const double v = volume(mesh);
  const auto t = mesh.triangles[7];
  mesh.vertices.push_back(1.2 * mesh.vertices[t[0]]);
  mesh.vertices.emplace_back(0, 0, 0);
  const int tip = static_cast<int>(mesh.vertices.size()) - 2;
  mesh.triangles.push_back({t[0], t[1], tip});      // a fin
  mesh.triangles.push_back({t[1], t[2], tip + 1});  // a wall inside
  mesh.triangles.push_back(mesh.triangles[100]);
  mesh.triangles.push_back({3, 3, 4});
  expect_repaired(mesh, 2, v, 1e-12);
  const RepairCounts counts = repair_mesh(mesh).counts;
  EXPECT_EQ(counts.parts, 2);
  EXPECT_EQ(counts.duplicate, 1);
  EXPECT_EQ(counts.degenerate, 1);
}

TEST(Repair, NotFiniteCornersAndBadIndicesLeaveAHoleThatIsFilled) {
  auto mesh = datasets::icosphere(0.05, 3);
  const double v = volume(mesh);
  mesh.vertices[100].x() = std::numeric_limits<double>::quiet_NaN();
  mesh.triangles[0][1] = -7;
  // Six triangles of 1280 become a flat patch: less than 1 % of the volume.
  expect_repaired(mesh, 2, v, 0.01 * v);
  EXPECT_GE(repair_mesh(mesh).counts.not_finite, 5);
  EXPECT_EQ(repair_mesh(mesh).counts.bad_indices, 1);
}

TEST(Repair, SpikeThroughTheBodyIsCutOff) {
  auto mesh = datasets::icosphere(0.05, 3);
  const double v = volume(mesh);
  mesh.vertices[50] *= -2;
  expect_repaired(mesh, 2, v, 0.03 * v);
  EXPECT_GT(repair_mesh(mesh).counts.crossing, 6);
}

// Two boxes through each other are two parts, both far from debris.
TEST(Repair, PartsThatOverlapAreJoinedByAWrap) {
  auto mesh = datasets::box({0.1, 0.1, 0.1}, 4);
  const auto other = mesh;
  for (const auto& p : other.vertices) mesh.vertices.push_back(p + Vec3(0.05, 0.03, 0.02));
  const int first = static_cast<int>(other.vertices.size());
  for (auto t : other.triangles) mesh.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
  const Repair repair = repair_mesh(mesh, {.wrap_alpha = 0.05});
  ASSERT_EQ(repair.outcome, RepairOutcome::wrapped) << repair.reason;
  EXPECT_EQ(flaw_of_solid(repair.mesh), "");
  // The union has 2 - 0.5 * 0.7 * 0.8 of a litre and 0.1 m2. The wrap is outside, by an offset of a twentieth
  // of alpha = 5 % of a diagonal of 0.24 m: 0.06 l if it were even. It fills the inner corners where the
  // boxes meet (0.8 m of them at most) with triangles of up to alpha^2 / 2: another 0.06 l.
  const double joined = 1e-3 * (2 - 0.5 * 0.7 * 0.8);
  EXPECT_GT(volume(repair.mesh), joined);
  EXPECT_LT(volume(repair.mesh), joined + 0.12e-3);

  const Repair largest = repair_mesh(mesh, {.parts = "largest"});
  EXPECT_EQ(largest.outcome, RepairOutcome::repaired);
  EXPECT_NEAR(volume(largest.mesh), 1e-3, 1e-12);
}

TEST(Repair, RejectsByName) {
  const auto reason = [](const TriangleMesh& mesh) {
    const Repair repair = repair_mesh(mesh, {.wrap_alpha = 0.05});
    EXPECT_EQ(repair.outcome, RepairOutcome::rejected);
    EXPECT_TRUE(repair.mesh.triangles.empty());
    return repair.reason;
  };
  EXPECT_NE(reason({}).find("no triangle"), std::string::npos);
  EXPECT_NE(reason(datasets::flat_grid(0.1, 8)).find("without an inside"), std::string::npos);
  auto two = datasets::icosphere(0.05, 2);
  const int first = static_cast<int>(two.vertices.size());
  for (int v = 0; v < first; ++v) two.vertices.push_back(two.vertices[v] + Vec3(1, 0, 0));
  for (int f = 0; f < 320; ++f) {
    const auto t = two.triangles[f];
    two.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
  }
  EXPECT_NE(reason(two).find("do not touch"), std::string::npos);
  EXPECT_EQ(reason(two).find("can be asked"), std::string::npos) << "no parameter of import asks for it";
  auto far = datasets::icosphere(0.05, 2);
  far.vertices[3].x() = 1e20;
  EXPECT_NE(reason(far).find("lies 1e+20 m away"), std::string::npos);
}

TEST(Repair, SameBytesAgain) {
  auto mesh = datasets::icosphere(0.05, 3);
  for (std::size_t v = 0; v < mesh.vertices.size(); v += 7) mesh.vertices[v] *= 1.2 - 0.4 * (v % 2);
  mesh.triangles.resize(mesh.triangles.size() - 100);
  const Repair a = repair_mesh(mesh), b = repair_mesh(mesh);
  EXPECT_EQ(a.mesh.vertices, b.mesh.vertices);
  EXPECT_EQ(a.mesh.triangles, b.mesh.triangles);
  EXPECT_EQ(a.added_m, b.added_m);
}

TEST(FillHoles, ClosesWhatIsSmallEnough) {
  auto mesh = datasets::icosphere(0.05, 3);
  mesh.triangles.erase(mesh.triangles.begin() + 10);
  auto left = mesh;
  EXPECT_EQ(fill_holes(left, 2), 0);
  EXPECT_EQ(fill_holes(mesh, 3), 1);
  EXPECT_TRUE(check_mesh(mesh).closed_manifold());
}

// Both ends of a tube: without their lids it has V = n/2 sin(2 pi / n) r^2 h of nothing.
TEST(FillHoles, ClosesTwoLoops) {
  auto tube = datasets::open_tube(0.03, 0.1, 24, 6);
  EXPECT_EQ(fill_holes(tube, 1000), 2);
  const auto report = check_mesh(tube);
  EXPECT_TRUE(report.closed_manifold()) << flaw(report);
  EXPECT_NEAR(report.volume_m3, 12 * std::sin(2 * M_PI / 24) * 0.03 * 0.03 * 0.1, 1e-15);
}

TEST(Crossings, SeesWhatMeetsAndOnlyThat) {
  EXPECT_TRUE(crossing_triangles(datasets::torus(0.04, 0.012, 24, 12)).empty());
  TriangleMesh pair;
  pair.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0.2, 0.2, -1}, {0.2, 0.2, 1}, {2, 2, 0}};
  pair.triangles = {{0, 1, 2}, {3, 4, 5}};
  const std::vector<std::pair<int, int>> both = {{0, 1}}, itself = {{0, 0}};
  EXPECT_EQ(crossing_triangles(pair), both);
  pair.vertices[3].z() = 0.5;  // now above
  EXPECT_TRUE(crossing_triangles(pair).empty());
  pair.vertices[3].z() = 0;  // touches
  EXPECT_EQ(crossing_triangles(pair), both);
  pair.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0.3, 0.3, 0}};  // folded flat over their common side
  pair.triangles = {{0, 1, 2}, {1, 0, 3}};
  EXPECT_EQ(crossing_triangles(pair), both);
  pair.vertices[3].y() = -1;
  EXPECT_TRUE(crossing_triangles(pair).empty());
  pair.triangles = {{0, 1, 1}};
  EXPECT_EQ(crossing_triangles(pair), itself);
}

TEST(SurfaceDistance, AgreesWithBruteForce) {
  const auto torus = datasets::torus(0.04, 0.012, 24, 12);
  const SurfaceDistance surface(torus);
  int nearest = 0;
  for (int i = 0; i < 200; ++i) {
    const Vec3 p(0.06 * std::sin(i), 0.06 * std::cos(1.7 * i), 0.03 * std::sin(0.3 * i));
    EXPECT_NEAR(surface.distance_m(p, nearest), brute_force_distance_m(torus, p), 1e-15);
    const auto& t = torus.triangles[nearest];
    const Vec3 foot =
        closest_point_on_triangle(p, torus.vertices[t[0]], torus.vertices[t[1]], torus.vertices[t[2]]);
    EXPECT_NEAR((p - foot).norm(), brute_force_distance_m(torus, p), 1e-15);
  }
}

// A plane 3 mm above another one that reaches farther: 3 mm everywhere.
TEST(SurfaceDistance, DeviationOfParallelPlanes) {
  auto above = datasets::flat_grid(0.1, 3);
  for (auto& p : above.vertices) p.z() = 0.003;
  const Deviation found = deviation(above, SurfaceDistance(datasets::flat_grid(0.2, 1)), 0.004);
  EXPECT_NEAR(found.max_m, 0.003, 1e-15);
  EXPECT_NEAR(found.mean_m, 0.003, 1e-15);
}

}  // namespace
}  // namespace geocage::geometry
