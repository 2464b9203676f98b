#include "topology/balls.h"

#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>
#include <map>
#include <numeric>
#include <random>
#include <set>

#include <gtest/gtest.h>
#include <omp.h>

#include "datasets/shapes.h"
#include "tests/pipeline/scratch_folder.h"

namespace geocage::topology {
namespace {

using geometry::Pose;
using geometry::TriangleMesh;

double sum(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0);
}

BallFields balls_of(const TriangleMesh& mesh, double radius_m, Metric metric = Metric::hop,
                    double guard = 1.1) {
  BallOptions options;
  options.eigenvalue_ratio_guard = guard;
  return ball_fields(mesh, {radius_m}, metric, options).radii.front();
}

/// A potato: no symmetry, so that no plane of a section goes through a vertex.
TriangleMesh potato(int subdivisions) {
  auto mesh = datasets::icosphere(1, subdivisions);
  for (Vec3& p : mesh.vertices)
    p = (1 + 0.2 * std::sin(2.3 * p.x() + 0.7 * p.y() - 0.4)) * Vec3(1.3 * p.x(), 0.8 * p.y(), p.z());
  return mesh;
}

/// Tube of radius 1 with near-equilateral triangles: each row is turned by half a column.
TriangleMesh equilateral_tube(int columns, int rows) {
  const double edge = 2 * M_PI / columns;
  TriangleMesh tube;
  for (int j = 0; j < rows; ++j)
    for (int i = 0; i < columns; ++i) {
      const double t = (i + 0.5 * j) * edge;
      tube.vertices.emplace_back(std::cos(t), std::sin(t), (j - rows / 2) * edge * std::sqrt(0.75));
    }
  for (int j = 0; j + 1 < rows; ++j)
    for (int i = 0; i < columns; ++i) {
      const int here = j * columns, up = here + columns, next = (i + 1) % columns;
      tube.triangles.push_back({here + i, here + next, up + i});
      tube.triangles.push_back({here + next, up + next, up + i});
    }
  return tube;
}

/// Unit grid sheared so that its triangles are equilateral: there a hop ball is a regular hexagon.
TriangleMesh equilateral_grid(int cells) {
  auto mesh = datasets::flat_grid(cells, cells);
  for (Vec3& p : mesh.vertices) p = {p.x() - p.y() / 2, p.y() * std::sqrt(0.75), 0};
  return mesh;
}

TEST(AngleDefect, RegularSolids) {
  const auto expect_each = [](const TriangleMesh& mesh, double defect) {
    for (double k : angle_defects_rad(mesh)) EXPECT_NEAR(k, defect, 1e-14);
  };
  expect_each(datasets::tetrahedron(), M_PI);
  expect_each(datasets::cube(), M_PI / 2);
  expect_each(datasets::octahedron(), 2 * M_PI / 3);
  expect_each(datasets::icosahedron(), M_PI / 3);
}

TEST(AngleDefect, AddsUpToTheEulerCharacteristic) {
  for (const auto& mesh : {datasets::icosphere(0.1, 4), datasets::torus(0.05, 0.012, 48, 24), potato(3),
                           datasets::cup(0.04, 0.1, 0.003, 48), datasets::box({1, 2, 3}, 4)})
    EXPECT_NEAR(sum(angle_defects_rad(mesh)), 2 * M_PI * check_mesh(mesh).euler, 1e-10);
}

TEST(AngleDefect, NoneInsideATube) {
  const auto tube = datasets::open_tube(1, 2, 64, 10);
  const auto defects = angle_defects_rad(tube);
  for (std::size_t v = 64; v + 64 < defects.size(); ++v) EXPECT_NEAR(defects[v], 0, 1e-12);  // not the rims
}

TEST(Balls, TotalCurvatureOfTheIcosphere) {
  const auto sphere = datasets::icosphere(1, 4);
  const auto set = ball_fields(sphere, {1.0, 1.5, 2.0}, Metric::hop);
  const std::vector<double> known = {2.2700, 4.4753, 7.2947};
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(set.radii[i].curvature_sum_rad[0], known[i], 5e-5);
}

// Edge paths are longer than great circles, by 15 % at most on these triangles: the ball lies between two
// caps.
TEST(Balls, DijkstraBallsLieBetweenCaps) {
  const auto sphere = datasets::icosphere(1, 4);
  for (double r : {0.6, 1.0, 2.0}) {
    const auto ball = balls_of(sphere, r, Metric::dijkstra);
    const auto cap = [](double angle) { return 2 * M_PI * (1 - std::cos(angle)); };
    for (double s : ball.curvature_sum_rad) {
      EXPECT_LT(s, cap(r) + 0.1);  // one ring of vertices, 2 pi sin(r) x half an edge
      EXPECT_GT(s, cap(r / 1.24));
    }
  }
}

TEST(Balls, WindingAngleOfATube) {
  const double edge = 2 * M_PI / 64;
  const auto tube = equilateral_tube(64, 91);
  const int middle = 45 * 64;
  const auto set = ball_fields(tube, {10.5 * edge, 1.5, 2.0, 2.5, 3.0, 3.5}, Metric::hop);
  const std::vector<double> known = {3.914, 4.340, 4.808, 5.343, 5.985, 2 * M_PI};
  for (std::size_t i = 0; i < known.size(); ++i) {
    EXPECT_NEAR(set.radii[i].winding_angle_rad[middle], known[i], 0.1);
    EXPECT_NEAR(set.radii[i].curvature_sum_rad[middle], 0, 1e-10);
  }
  for (std::size_t i = 1; i < known.size(); ++i)
    EXPECT_GT(set.radii[i].winding_angle_rad[middle], set.radii[i - 1].winding_angle_rad[middle]);
}

TEST(Balls, RingAroundATorusIsAnAnnulus) {
  // The tube is 2 pi 0.3 = 1.9 around and 2 pi = 6.3 along: a ball of radius 1.3 meets itself behind the
  // tube.
  const auto ball = balls_of(datasets::torus(1, 0.3, 80, 24), 1.3);
  for (std::size_t v = 0; v < ball.euler.size(); ++v) {
    EXPECT_EQ(ball.euler[v], 0);
    EXPECT_EQ(ball.winding_angle_rad[v], 2 * M_PI);
  }
}

TEST(Balls, FlatDiscHasNoAxisUnlessTheGuardIsOff) {
  const int cells = 20, middle = (cells / 2) * (cells + 1) + cells / 2;
  const auto grid = equilateral_grid(cells);
  EXPECT_TRUE(std::isnan(balls_of(grid, 5.5).winding_angle_rad[middle]));
  EXPECT_EQ(balls_of(grid, 5.5).axis[middle], Vec3::Zero());
  EXPECT_EQ(balls_of(grid, 5.5, Metric::hop, 1.0 - 1e-9).winding_angle_rad[middle], M_PI);
}

TEST(Balls, HexagonOfHops) {
  const int cells = 20, middle = (cells / 2) * (cells + 1) + cells / 2, hops = 5;
  const auto ball = balls_of(equilateral_grid(cells), hops + 0.5);
  EXPECT_EQ(ball.ball_vertices[middle], 3 * hops * (hops + 1) + 1);
  EXPECT_EQ(ball.ball_triangles[middle], 6 * hops * hops);
  EXPECT_EQ(ball.euler[middle], 1);
  EXPECT_NEAR(ball.ball_area_m2[middle], 6 * hops * hops * std::sqrt(3.0) / 4, 1e-12);
}

TEST(Balls, WholeSurface) {
  for (const auto& mesh : {potato(2), datasets::torus(1, 0.3, 40, 12)}) {
    const auto report = check_mesh(mesh);
    const auto ball = balls_of(mesh, 100);
    EXPECT_NEAR(median_share(ball, report.area_m2), 1, 1e-12);
    for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
      EXPECT_EQ(ball.euler[v], report.euler);
      EXPECT_EQ(ball.ball_triangles[v], report.triangles);
      EXPECT_NEAR(ball.curvature_sum_rad[v], 2 * M_PI * report.euler, 1e-10);
    }
  }
}

TEST(Balls, SmallestBallIsItsVertex) {
  const auto mesh = potato(1);
  const auto ball = balls_of(mesh, 1e-6);
  const auto defects = angle_defects_rad(mesh);
  EXPECT_EQ(median_share(ball, 1), 0);
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    EXPECT_NEAR(ball.curvature_sum_rad[v], defects[v], 1e-13);  // another way, six angles rounded
    EXPECT_EQ(ball.ball_vertices[v], 1);
    EXPECT_EQ(ball.euler[v], 0);  // no triangle, nothing to count
    EXPECT_TRUE(std::isnan(ball.winding_angle_rad[v]));
  }
}

/// Distances between all vertices by Floyd and Warshall: a second method for the searches.
std::vector<std::vector<double>> all_distances(const TriangleMesh& mesh, Metric metric) {
  const std::size_t n = mesh.vertices.size();
  std::vector d(n, std::vector(n, std::numeric_limits<double>::infinity()));
  const double hop = mean_edge_m(mesh);
  for (std::size_t v = 0; v < n; ++v) d[v][v] = 0;
  for (const auto& t : mesh.triangles)
    for (int i = 0; i < 3; ++i) {
      const int a = t[i], b = t[(i + 1) % 3];
      d[a][b] = d[b][a] = metric == Metric::hop ? hop : (mesh.vertices[a] - mesh.vertices[b]).norm();
    }
  for (std::size_t k = 0; k < n; ++k)
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t j = 0; j < n; ++j) d[i][j] = std::min(d[i][j], d[i][k] + d[k][j]);
  return d;
}

TEST(Balls, AgreeWithASecondMethod) {
  const auto mesh = potato(2);
  const auto defects = angle_defects_rad(mesh);
  for (const Metric metric : {Metric::hop, Metric::dijkstra}) {
    const double r = 2.5 * mean_edge_m(mesh);
    const auto ball = balls_of(mesh, r, metric);
    const auto d = all_distances(mesh, metric);
    for (std::size_t p = 0; p < mesh.vertices.size(); ++p) {
      int vertices = 0, triangles = 0;
      double curvature = 0;
      Vec3 center = Vec3::Zero();
      for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
        if (d[p][v] <= r) {
          ++vertices;
          curvature += defects[v];
          center += mesh.vertices[v];
        }
      std::set<int> used;
      std::set<std::pair<int, int>> edges;
      for (const auto& t : mesh.triangles)
        if (d[p][t[0]] <= r && d[p][t[1]] <= r && d[p][t[2]] <= r) {
          ++triangles;
          used.insert(t.begin(), t.end());
          for (int i = 0; i < 3; ++i) edges.insert(std::minmax(t[i], t[(i + 1) % 3]));
        }
      EXPECT_EQ(ball.ball_vertices[p], vertices);
      EXPECT_EQ(ball.ball_triangles[p], triangles);
      EXPECT_EQ(ball.euler[p], static_cast<int>(used.size()) - static_cast<int>(edges.size()) + triangles);
      EXPECT_NEAR(ball.curvature_sum_rad[p], curvature, 1e-12);
      EXPECT_LT((ball.center[p] - center / vertices).norm(), 1e-14);
    }
  }
}

// The axis turns by eps / (gap of eigenvalues, at least 0.1 of the largest): 1e-14 and a few steps of that.
void expect_same(const BallFields& x, std::size_t v, const BallFields& y, std::size_t w) {
  EXPECT_NEAR(x.curvature_sum_rad[v], y.curvature_sum_rad[w], 1e-11);
  EXPECT_EQ(std::isnan(x.winding_angle_rad[v]), std::isnan(y.winding_angle_rad[w]));
  EXPECT_EQ(x.ball_vertices[v], y.ball_vertices[w]);
  EXPECT_EQ(x.ball_triangles[v], y.ball_triangles[w]);
  EXPECT_EQ(x.euler[v], y.euler[w]);
  if (std::isnan(x.winding_angle_rad[v])) return;
  EXPECT_NEAR(x.winding_angle_rad[v], y.winding_angle_rad[w], 1e-10);
}

// Gauss and Bonnet: the curvature of a ball's inner vertices and the turning of its border, pi a border edge
// less the angles on the ball's side, add up to 2 pi times its Euler number, 2 pi for a disc. A few hundred
// angles, each rounded at 2^-52: 1e-11.
TEST(Balls, CurvatureAndTurningOfTheBorderAddUpToTheEulerNumber) {
  auto torus = datasets::torus(1, 0.3, 50, 15);
  for (Vec3& p : torus.vertices) p *= 1 + 0.1 * std::sin(5 * p.x() + 3 * p.y()) * std::cos(4 * p.z());
  const auto defects = angle_defects_rad(torus);
  for (const Metric metric : {Metric::hop, Metric::dijkstra}) {
    int discs = 0;
    const double r = 0.6;
    const auto fields = balls_of(torus, r, metric);
    for (int p = 0; p < static_cast<int>(torus.vertices.size()); p += 8) {
      const Ball ball = section_of_ball(torus, p, r, metric);
      std::map<std::pair<int, int>, int> edges;  // of the ball's triangles
      std::map<int, double> angles;
      for (int f : ball.triangles)
        for (int i = 0; i < 3; ++i) {
          const auto& t = torus.triangles[f];
          const int a = t[i], b = t[(i + 1) % 3], c = t[(i + 2) % 3];
          ++edges[std::minmax(a, b)];
          const Vec3 to = torus.vertices[b] - torus.vertices[a],
                     other = torus.vertices[c] - torus.vertices[a];
          angles[a] += std::atan2(to.cross(other).norm(), to.dot(other));
        }
      std::map<int, int> border;  // border edges at a vertex
      for (const auto& [edge, sides] : edges)
        if (sides == 1)
          for (const int v : {edge.first, edge.second}) ++border[v];
      double inside = fields.curvature_sum_rad[p], turning = 0;
      for (int v : ball.vertices)
        if (border.count(v) || !angles.count(v)) inside -= defects[v];
      for (const auto& [v, count] : border) turning += 2 * M_PI - angles[v] - M_PI * count / 2;
      EXPECT_NEAR(inside + turning, 2 * M_PI * fields.euler[p], 1e-11) << p;
      discs += fields.euler[p] == 1 && ball.boundary_loops == 1;
    }
    EXPECT_GT(discs, 40);
  }
}

TEST(Balls, MovedAndScaledMeshesSayTheSame) {
  const auto mesh = potato(3);
  auto moved = mesh;
  const Pose X(Eigen::Translation3d(0.3, -0.2, 0.5) * Eigen::AngleAxisd(1.1, Vec3(1, -2, 3).normalized()));
  for (Vec3& p : moved.vertices) p = X * (0.05 * p);
  for (const Metric metric : {Metric::hop, Metric::dijkstra}) {
    const double r = 5.5 * mean_edge_m(mesh);
    const auto one = balls_of(mesh, r, metric), other = balls_of(moved, 0.05 * r, metric);
    for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
      expect_same(one, v, other, v);
      EXPECT_NEAR(other.ball_area_m2[v], 0.05 * 0.05 * one.ball_area_m2[v], 1e-12);
      EXPECT_LT((other.center[v] - X * Vec3(0.05 * one.center[v])).norm(), 1e-14);
    }
  }
}

// A mirror with the order of corners turned round, so that the inside stays inside: distances, areas and
// defects are those of the mesh, the winding angle of thesis 3.5 is an unsigned sweep. What has a hand is
// the frame of axis and normal: centres and axes are the mirrored ones, an axis up to its free sign, and the
// volume of axis, normal and centre changes sign with it.
TEST(Balls, MirroredMeshesSayTheSameWithMirroredFrames) {
  const auto mesh = potato(3);
  const Vec3 flip(-1, 1, 1);
  auto mirrored = mesh;
  for (Vec3& p : mirrored.vertices) p = p.cwiseProduct(flip);
  for (auto& t : mirrored.triangles) std::swap(t[1], t[2]);
  const double r = 5.5 * mean_edge_m(mesh);
  for (const Metric metric : {Metric::hop, Metric::dijkstra}) {
    const auto one = balls_of(mesh, r, metric), other = balls_of(mirrored, r, metric);
    int with_axis = 0;
    for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
      expect_same(one, v, other, v);
      EXPECT_LT((other.center[v] - Vec3(one.center[v].cwiseProduct(flip))).norm(), 1e-14);
      const Vec3 image = one.axis[v].cwiseProduct(flip);
      // as for expect_same: a few steps of eps over the gap
      EXPECT_LT(std::min((other.axis[v] - image).norm(), (other.axis[v] + image).norm()), 1e-12);
      with_axis += one.axis[v].norm() > 0;
    }
    EXPECT_GT(with_axis, static_cast<int>(mesh.vertices.size()) / 4);
  }
}

TEST(Balls, OrderOfVerticesAndTrianglesIsNoMatter) {
  const auto mesh = potato(3);
  std::vector<int> to(mesh.vertices.size());
  std::iota(to.begin(), to.end(), 0);
  std::shuffle(to.begin(), to.end(), std::mt19937_64(1));
  TriangleMesh other = mesh;
  for (std::size_t v = 0; v < to.size(); ++v) other.vertices[to[v]] = mesh.vertices[v];
  for (auto& t : other.triangles) t = {to[t[1]], to[t[2]], to[t[0]]};
  std::shuffle(other.triangles.begin(), other.triangles.end(), std::mt19937_64(2));
  const double r = 5.5 * mean_edge_m(mesh);
  const auto one = balls_of(mesh, r), two = balls_of(other, r);
  for (std::size_t v = 0; v < to.size(); ++v) expect_same(one, v, two, static_cast<std::size_t>(to[v]));
}

TEST(Balls, ManyRadiiAtOnceAreTheSameAsOneByOne) {
  const auto mesh = potato(3);
  const auto set = ball_fields(mesh, {0.7, 0.2, 0.4}, Metric::dijkstra);
  for (const auto& ball : set.radii) {
    const auto alone = balls_of(mesh, ball.radius_m, Metric::dijkstra);
    EXPECT_EQ(ball.ball_vertices, alone.ball_vertices);
    EXPECT_EQ(ball.ball_triangles, alone.ball_triangles);
    for (std::size_t v = 0; v < mesh.vertices.size(); ++v)  // added up in another order: 500 terms below 1
      EXPECT_NEAR(ball.curvature_sum_rad[v], alone.curvature_sum_rad[v], 1e-12);
  }
}

bool same_bytes(const std::vector<double>& a, const std::vector<double>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(double)) == 0;
}
bool same_bytes(const BallFields& a, const BallFields& b) {
  return a.radius_m == b.radius_m && same_bytes(a.curvature_sum_rad, b.curvature_sum_rad) &&
         same_bytes(a.winding_angle_rad, b.winding_angle_rad) &&
         same_bytes(a.accumulated_angle_rad, b.accumulated_angle_rad) &&
         same_bytes(a.ball_area_m2, b.ball_area_m2) && a.ball_vertices == b.ball_vertices &&
         a.ball_triangles == b.ball_triangles && a.euler == b.euler && a.center == b.center &&
         a.axis == b.axis;
}

TEST(Balls, SameBytesForAnyThreadCount) {
  const auto mesh = potato(4);
  omp_set_num_threads(1);
  const auto one = balls_of(mesh, 0.4);
  omp_set_num_threads(4);
  const auto four = balls_of(mesh, 0.4);
  EXPECT_TRUE(same_bytes(one, four));
}

TEST(BallFiles, SetsReadBackExactly) {
  const tests::ScratchFolder folder;
  const auto written = ball_fields(datasets::icosphere(1.0 / 3, 2), {0.1, 0.3}, Metric::hop);
  EXPECT_TRUE(std::isnan(written.radii[0].winding_angle_rad[0]));  // NaN travels too
  save_artefact(written, folder.path());
  BallSet read;
  load_artefact(read, folder.path());
  ASSERT_EQ(read.radii.size(), 2u);
  for (int i = 0; i < 2; ++i) EXPECT_TRUE(same_bytes(read.radii[i], written.radii[i]));
}

}  // namespace
}  // namespace geocage::topology
