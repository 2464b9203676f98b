// The lane-parallel balls against the plain ones: every lane, every radius, both metrics, every instruction
// set.
#include "topology/lane_balls.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numeric>

#include <gtest/gtest.h>
#include <omp.h>

#include "datasets/shapes.h"
#include "geometry/instruction_sets.h"
#include "topology/ball_mesh.h"
#include "topology/ball_region.h"
#include "topology/ball_rows.h"
#include "topology/plain_balls.h"

namespace geocage::topology {
namespace {

using geometry::TriangleMesh;

/// Dents and swells without any symmetry, so that no plane of a section goes through a vertex.
TriangleMesh dented(TriangleMesh mesh) {
  for (Vec3& p : mesh.vertices)
    p *= 1 + 0.2 * std::sin(5.3 * p.x() + 0.7 * p.y() - 0.4) * std::cos(4 * p.z() + p.x());
  return mesh;
}

/// A tube along a trefoil knot: genus 1, and sheets that come near to each other.
TriangleMesh knot(int along, int around) {
  auto mesh = datasets::torus(2, 1, along, around);
  for (Vec3& p : mesh.vertices) {
    const double t = std::atan2(p.y(), p.x()), ring = std::hypot(p.x(), p.y()) - 2, up = p.z();
    const Vec3 center(std::sin(t) + 2 * std::sin(2 * t), std::cos(t) - 2 * std::cos(2 * t), -std::sin(3 * t));
    const Vec3 along_t =
        Vec3(std::cos(t) + 4 * std::cos(2 * t), -std::sin(t) + 4 * std::sin(2 * t), -3 * std::cos(3 * t))
            .normalized();
    const Vec3 side = along_t.cross(Vec3::UnitZ()).normalized();
    p = center + 0.4 * (ring * side + up * side.cross(along_t));
  }
  return mesh;
}

/// Two bodies, so that a region never holds the whole mesh.
TriangleMesh two_bodies() {
  auto mesh = dented(datasets::icosphere(1, 3));
  const auto other = dented(datasets::torus(1, 0.4, 40, 16));
  const int count = static_cast<int>(mesh.vertices.size());
  for (const Vec3& p : other.vertices) mesh.vertices.push_back(p + Vec3(0.2, 0.1, 2));
  for (const auto& t : other.triangles) mesh.triangles.push_back({t[0] + count, t[1] + count, t[2] + count});
  return mesh;
}

std::vector<TriangleMesh> shapes() {
  return {dented(datasets::icosphere(1, 3)),
          dented(datasets::torus(1, 0.3, 60, 18)),
          knot(120, 10),
          dented(datasets::box({1, 2, 3}, 5)),
          datasets::cup(0.04, 0.1, 0.003, 16),
          two_bodies(),
          datasets::capped_cylinder(1, 2, 24),
          datasets::flat_grid(1, 16),
          datasets::open_tube(1, 2, 24, 10),
          datasets::tetrahedron()};
}

/// Sums of 1e3..1e4 terms of either sign, relative to the sum of their absolute values.
constexpr double sum_tolerance = 1e-12;

void expect_same_balls(const BallFields& lane, const BallFields& plain, const TriangleMesh& mesh) {
  double defects = 0;
  for (double k : angle_defects_rad(mesh)) defects += std::abs(k);
  const double size = check_mesh(mesh).diagonal_m();
  EXPECT_EQ(lane.ball_vertices, plain.ball_vertices);
  EXPECT_EQ(lane.ball_triangles, plain.ball_triangles);
  EXPECT_EQ(lane.euler, plain.euler);
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    EXPECT_NEAR(lane.curvature_sum_rad[v], plain.curvature_sum_rad[v], sum_tolerance * defects);
    EXPECT_NEAR(lane.ball_area_m2[v], plain.ball_area_m2[v], sum_tolerance * plain.ball_area_m2[v]);
    EXPECT_LT((lane.center[v] - plain.center[v]).norm(), sum_tolerance * size);
  }
}

TEST(LaneBalls, AreThePlainBallsInEveryLane) {
  for (const auto& mesh : shapes())
    for (const Metric metric : {Metric::hop, Metric::dijkstra}) {
      const double diagonal = check_mesh(mesh).diagonal_m();
      const std::vector<double> radii = {1e-6 * diagonal, 0.03 * diagonal, 0.1 * diagonal, 0.31 * diagonal,
                                         5 * diagonal};
      const auto lane = lane_ball_fields(mesh, radii, metric, {}),
                 plain = plain_ball_fields(mesh, radii, metric);
      for (std::size_t q = 0; q < radii.size(); ++q) expect_same_balls(lane.radii[q], plain.radii[q], mesh);
    }
}

// The section is judged with the ball's own centre and axis: its triangles cut by the independent search.
TEST(LaneBalls, SectionsAreThoseOfTheIndependentSearch) {
  int compared = 0;
  for (const auto& mesh : {dented(datasets::icosphere(1, 4)), dented(datasets::torus(1, 0.3, 80, 24)),
                           knot(200, 14), two_bodies(), datasets::cup(0.04, 0.1, 0.003, 32)})
    for (const double share : {0.08, 0.2}) {
      const double radius = share * check_mesh(mesh).diagonal_m();
      const auto ball = lane_ball_fields(mesh, {radius}, Metric::hop, {}).radii.front();
      const NumberedEdges edges(mesh);
      Cutter cutter(mesh, edges);
      const auto neighbours = vertex_neighbours(mesh), around = vertex_triangles(mesh);
      PlainSearch search(mesh, neighbours, mean_edge_m(mesh));
      for (int v = 0; v < static_cast<int>(mesh.vertices.size()); v += 3) {
        if (ball.axis[v] == Vec3::Zero()) continue;
        search.run(v, radius, Metric::hop);
        const int count = search.count_within(radius);
        std::vector<int> inside;
        for (int i = 0; i < count; ++i)
          for (int k = around.start[search.vertex(i)]; k < around.start[search.vertex(i) + 1]; ++k) {
            const auto& t = mesh.triangles[around.items[k]];
            if (t[0] == search.vertex(i) &&
                std::max({search.rank(t[0]), search.rank(t[1]), search.rank(t[2])}) < count)
              inside.push_back(around.items[k]);
          }
        const Section section = cutter.cut(inside, mesh.vertices[v], ball.center[v], ball.axis[v]);
        // Angles of at most 200 steps, each to 1e-15 and the ends to 1e-16 / (their distance from the
        // centre).
        EXPECT_NEAR(ball.winding_angle_rad[v], winding_angle_rad(section, ball.center[v], ball.axis[v]),
                    1e-11);
        EXPECT_NEAR(ball.accumulated_angle_rad[v],
                    accumulated_angle_rad(section, ball.center[v], ball.axis[v]), 1e-11);
        ++compared;
      }
    }
  EXPECT_GT(compared, 5000);
}

// A symmetric ball's centre is a vertex, and its plane goes through that. Rounding must not decide which way
// the section goes round it, let alone go round twice: a flat ball winds by half a turn.
TEST(LaneBalls, FlatBallsWindByHalfATurn) {
  const auto mesh = datasets::flat_grid(1, 40);
  for (const double radius : {0.05, 0.07, 0.14})
    for (const Metric metric : {Metric::hop, Metric::dijkstra}) {
      const auto lane = lane_ball_fields(mesh, {radius}, metric, {}).radii[0],
                 plain = plain_ball_fields(mesh, {radius}, metric).radii[0];
      for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
        EXPECT_FALSE(plain.winding_angle_rad[v] > 6) << v;
        if (std::isnan(plain.winding_angle_rad[v]))
          EXPECT_TRUE(std::isnan(lane.winding_angle_rad[v])) << v;
        else
          EXPECT_NEAR(lane.winding_angle_rad[v], plain.winding_angle_rad[v], 1e-7) << v;
      }
    }
}

// Some of these balls are symmetric and have axes 30 degrees off a coordinate axis: their sign, and with it
// the side on which the plane passes the centre, must not hang on rounding either.
TEST(LaneBalls, SymmetricBallsWindAsThePlainOnes) {
  const auto mesh = datasets::torus(1, 0.3, 120, 36);
  const double radius = 0.03 * check_mesh(mesh).diagonal_m();
  const auto lane = lane_ball_fields(mesh, {radius}, Metric::dijkstra, {}).radii[0],
             plain = plain_ball_fields(mesh, {radius}, Metric::dijkstra).radii[0];
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    ASSERT_EQ(std::isnan(lane.winding_angle_rad[v]), std::isnan(plain.winding_angle_rad[v])) << v;
    if (std::isnan(lane.winding_angle_rad[v])) continue;
    EXPECT_NEAR(lane.winding_angle_rad[v], plain.winding_angle_rad[v], 1e-7) << v;
  }
}

// A long thin strip of surface has more hops than a byte holds: the plain way takes over. Where the surface
// ends sooner than the radius, it need not.
TEST(LaneBalls, MoreHopsThanAByteHolds) {
  const auto rod = dented(datasets::torus(20, 0.05, 700, 3));
  LaneReport report;
  const double hop = mean_edge_m(rod);
  const auto lane = lane_ball_fields(rod, {270.5 * hop, 250.5 * hop}, Metric::hop, {}, &report);
  EXPECT_GT(report.searched_plainly, 0);
  const auto plain = plain_ball_fields(rod, {270.5 * hop, 250.5 * hop}, Metric::hop);
  for (int q = 0; q < 2; ++q) expect_same_balls(lane.radii[q], plain.radii[q], rod);
  lane_ball_fields(datasets::icosphere(1, 3), {1e6}, Metric::hop, {}, &report);
  EXPECT_EQ(report.searched_plainly, 0);
}

// Where sums of edges come out as the radius itself, whole quanta can't decide.
TEST(LaneBalls, VerticesAtTheRadiusAreDecidedByThePlainSearch) {
  const auto grid = datasets::flat_grid(1, 20);  // edges of 1/20 and of sqrt(2)/20
  LaneReport report;
  const auto lane = lane_ball_fields(grid, {0.25}, Metric::dijkstra, {}, &report);
  EXPECT_EQ(report.searched_plainly, static_cast<int>(grid.vertices.size()));
  expect_same_balls(lane.radii[0], plain_ball_fields(grid, {0.25}, Metric::dijkstra).radii[0], grid);
}

bool same_bytes(const std::vector<double>& a, const std::vector<double>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(double)) == 0;
}
bool same_bytes(const BallFields& a, const BallFields& b) {
  return same_bytes(a.curvature_sum_rad, b.curvature_sum_rad) &&
         same_bytes(a.winding_angle_rad, b.winding_angle_rad) &&
         same_bytes(a.accumulated_angle_rad, b.accumulated_angle_rad) &&
         same_bytes(a.ball_area_m2, b.ball_area_m2) && a.ball_vertices == b.ball_vertices &&
         a.ball_triangles == b.ball_triangles && a.euler == b.euler && a.center == b.center &&
         a.axis == b.axis;
}

TEST(LaneBalls, SameBytesForEveryInstructionSetAndThreadCount) {
  const auto mesh = knot(200, 14);
  const char* names[8];
  const int sets = geometry::instruction_sets(names, 8);
  ASSERT_GE(sets, 1);
  for (const Metric metric : {Metric::hop, Metric::dijkstra}) {
    const auto wanted = lane_ball_fields(mesh, {0.9, 2.1}, metric, {});
    for (int i = 0; i < sets; ++i) {
      geometry::force_instruction_set(names[i]);
      omp_set_num_threads(1 + i % 2);
      const auto got = lane_ball_fields(mesh, {0.9, 2.1}, metric, {});
      for (int q = 0; q < 2; ++q) EXPECT_TRUE(same_bytes(got.radii[q], wanted.radii[q])) << names[i];
    }
    geometry::force_instruction_set("");
    omp_set_num_threads(2);
  }
}

// What one call leaves behind is nothing to the next: fewer radii and lanes, another metric, more threads.
TEST(LaneBalls, AskedAgainGivesTheSameBytes) {
  const auto mesh = knot(120, 10);
  LaneBalls kept(mesh);
  BallOptions sums_only;
  sums_only.winding = false;
  const auto expect_same = [&](const std::vector<double>& radii, Metric metric, const BallOptions& options,
                               int threads) {
    omp_set_num_threads(threads);
    LaneReport again, once;
    const auto got = kept.fields(radii, metric, options, &again),
               wanted = lane_ball_fields(mesh, radii, metric, options, &once);
    for (std::size_t q = 0; q < radii.size(); ++q) EXPECT_TRUE(same_bytes(got.radii[q], wanted.radii[q]));
    EXPECT_EQ(again.searched_whole, once.searched_whole);
    EXPECT_EQ(again.searched_plainly, once.searched_plainly);
  };
  expect_same({2.1, 0.9}, Metric::hop, {}, 1);
  expect_same({0.3}, Metric::hop, {}, 2);
  expect_same({0.2, 1.4, 0.7}, Metric::dijkstra, {}, 2);
  expect_same({1.1}, Metric::dijkstra, sums_only, 1);
  expect_same({2.1, 0.9}, Metric::hop, {}, 2);
  EXPECT_TRUE(LaneBalls({}).fields({1}, Metric::hop, {}).radii.front().center.empty());
}

// Where a ring closes, its crossings on both sides of the start count as walked: no search of the whole ball.
TEST(LaneBalls, RingsNeedNoWholeSearch) {
  LaneReport report;
  const auto ball =
      lane_ball_fields(dented(datasets::torus(1, 0.3, 100, 30)), {1.3}, Metric::hop, {}, &report);
  const auto& angles = ball.radii[0].winding_angle_rad;
  EXPECT_GT(std::count(angles.begin(), angles.end(), 2 * M_PI), 1000);
  EXPECT_LT(report.searched_whole, 100);
}

// Six balls of a sphere made from a cube lie square to their axes: the plane cuts them in a ring round their
// middle, all of it as near to the source, and longer than what a walk notes.
TEST(LaneBalls, RingsRoundTheirSourceNeedNoWholeSearch) {
  auto sphere = datasets::box({2, 2, 2}, 32);
  for (Vec3& p : sphere.vertices) p = Vec3((M_PI / 4 * p.array()).tan()).normalized();
  LaneReport report;
  const double radius = 0.3 * check_mesh(sphere).diagonal_m();
  const auto lane = lane_ball_fields(sphere, {radius}, Metric::hop, {}, &report).radii[0];
  EXPECT_EQ(report.searched_whole, 0);
  BallSet plain;
  plain.radii.push_back(BallFields::of_size(sphere.vertices.size(), radius));
  std::vector<int> poles;
  for (int v = 0; v < static_cast<int>(sphere.vertices.size()); ++v)
    if (sphere.vertices[v].cwiseAbs().maxCoeff() > 1 - 1e-9) poles.push_back(v);
  ASSERT_EQ(poles.size(), 6u);
  PlainBalls(sphere, Metric::hop, {}).measure(poles, plain);
  for (int v : poles) EXPECT_NEAR(lane.winding_angle_rad[v], plain.radii[0].winding_angle_rad[v], 1e-7) << v;
}

// The edge path ends within an edge of the section's ends: on the tube of 32 columns the angle of two columns
// at most, seen from a centre at half the radius or farther.
TEST(LaneBalls, EdgePathsWindLikeTheirSections) {
  const auto tube = datasets::open_tube(1, 4, 32, 20);
  BallOptions options;
  options.section = SectionPath::edges;
  const auto plane = ball_fields(tube, {1.5}, Metric::dijkstra).radii[0];
  const auto edges = ball_fields(tube, {1.5}, Metric::dijkstra, options).radii[0];
  EXPECT_EQ(plane.ball_vertices, edges.ball_vertices);
  for (int v = 10 * 32; v < 11 * 32; ++v) {
    ASSERT_FALSE(std::isnan(edges.winding_angle_rad[v]));
    EXPECT_NEAR(edges.winding_angle_rad[v], plane.winding_angle_rad[v], 4 * 2 * M_PI / 32);
  }
}

TEST(LaneBalls, WithoutWindingTheRestIsTheSame) {
  const auto mesh = dented(datasets::icosphere(1, 3));
  BallOptions options;
  options.winding = false;
  const auto with = ball_fields(mesh, {0.5}, Metric::hop).radii[0];
  const auto without = ball_fields(mesh, {0.5}, Metric::hop, options).radii[0];
  EXPECT_EQ(with.curvature_sum_rad, without.curvature_sum_rad);
  EXPECT_EQ(with.axis, without.axis);
  for (double w : without.winding_angle_rad) EXPECT_TRUE(std::isnan(w));
}

TEST(BallMesh, LinksGoRoundEachVertex) {
  const auto mesh = dented(datasets::icosphere(1, 2));
  const BallMesh ball(mesh);
  double area = 0;
  for (double triangle : ball.links.area_m2) area += triangle;
  EXPECT_NEAR(area, 3 * check_mesh(mesh).area_m2, 1e-12);  // each triangle is seen from its three corners
  for (int h = 0; h < static_cast<int>(ball.half_edges.size()); ++h) EXPECT_EQ(ball.twin(ball.twin(h)), h);
  EXPECT_NEAR(ball.mean_edge_m, mean_edge_m(mesh), 1e-15);
}

geometry::TriangleMesh bipyramid(int sides) {
  geometry::TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0.3}, {0, 0, -0.2}};
  for (int i = 0; i < sides; ++i) {
    const double angle = 2 * M_PI * i / sides;
    mesh.vertices.emplace_back(std::cos(angle), std::sin(angle), 0);
    const int a = 2 + i, b = 2 + (i + 1) % sides;
    mesh.triangles.push_back({0, a, b});
    mesh.triangles.push_back({1, b, a});
  }
  return mesh;
}

// The defects' other way: products of complex numbers instead of sums of arc tangents. Each of 4000 angles at
// most is rounded at 2^-52: 1e-12. Their product would fade to nothing; and where a triangle is too thin, all
// angles come from three corners at once.
TEST(BallMesh, DefectsAreThoseOfTheMesh) {
  auto spike = dented(datasets::icosphere(1, 2));
  spike.vertices[3] = spike.vertices[static_cast<std::size_t>(spike.triangles[0][0])] * 40;
  auto needle = dented(datasets::icosphere(1, 2));
  const auto t = needle.triangles[7];
  needle.vertices[t[0]] = 0.5 * (needle.vertices[t[1]] + needle.vertices[t[2]]);
  for (const auto& mesh : {dented(datasets::torus(1, 0.3, 80, 24)), dented(datasets::box({1, 2, 3}, 3)),
                           bipyramid(4000), spike, needle}) {
    const BallMesh ball(mesh);
    const auto defects = angle_defects_rad(mesh);
    double sum = 0;
    for (int v = 0; v < ball.count; ++v) {
      sum += ball.points[v].defect_rad;
      EXPECT_NEAR(ball.points[v].defect_rad, defects[ball.original[v]], 1e-12);
    }
    EXPECT_NEAR(sum, 2 * M_PI * check_mesh(mesh).euler, 1e-10);
  }
}

TEST(Patches, HoldEachVertexOnce) {
  const BallMesh mesh(two_bodies());
  Patches patches(mesh);
  std::vector<int> all, again;
  for (auto patch = patches.next(); !patch.empty(); patch = patches.next()) {
    EXPECT_LE(patch.size(), lanes);
    all.insert(all.end(), patch.begin(), patch.end());
  }
  patches.rewind();
  for (auto patch = patches.next(); !patch.empty(); patch = patches.next())
    again.insert(again.end(), patch.begin(), patch.end());
  EXPECT_EQ(again, all);
  ASSERT_EQ(static_cast<int>(all.size()), mesh.count);
  std::sort(all.begin(), all.end());
  for (int v = 0; v < mesh.count; ++v) EXPECT_EQ(all[v], v);
}

// A tube has one loop at each end; a ball round a handle has two; a ball that is the whole surface none.
TEST(Ball, LoopsOfItsBorder) {
  const auto torus = datasets::torus(1, 0.3, 80, 24);
  EXPECT_EQ(section_of_ball(torus, 0, 0.5, Metric::hop).boundary_loops, 1);
  EXPECT_EQ(section_of_ball(torus, 0, 1.3, Metric::hop).boundary_loops, 2);
  EXPECT_EQ(section_of_ball(torus, 0, 100, Metric::hop).boundary_loops, 0);
  EXPECT_EQ(section_of_ball(torus, 0, 1e-6, Metric::hop).boundary_loops, 0);
}

TEST(Ball, IsTheOneOfTheFields) {
  const auto mesh = dented(datasets::torus(1, 0.3, 80, 24));
  const auto fields = ball_fields(mesh, {0.7}, Metric::dijkstra).radii[0];
  for (const int v : {0, 77, 900}) {
    const Ball ball = section_of_ball(mesh, v, 0.7, Metric::dijkstra);
    EXPECT_EQ(static_cast<int>(ball.vertices.size()), fields.ball_vertices[v]);
    EXPECT_EQ(static_cast<int>(ball.triangles.size()), fields.ball_triangles[v]);
    EXPECT_EQ(ball.has_axis, fields.axis[v] != Vec3::Zero());
    EXPECT_NEAR(std::abs(ball.axis.dot(fields.axis[v])), 1, 1e-12);
    EXPECT_NEAR(ball.winding_angle_rad, fields.winding_angle_rad[v], 1e-10);
    EXPECT_NEAR(winding_angle_rad(ball.section, ball.center, ball.axis), ball.winding_angle_rad, 0);
  }
}

}  // namespace
}  // namespace geocage::topology
