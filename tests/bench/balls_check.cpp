// Compares every ball of every vertex with the plain search on shapes of up to 100k vertices and on mesh
// files named on the command line: too long for a test. Usage: geocage_balls_check [SHARE] [MESH...]; exit
// code 1 where any differs.
#include <algorithm>
#include <cmath>
#include <cstdlib>

#include <fmt/format.h>

#include "datasets/shapes.h"
#include "geometry/mesh_files.h"
#include "topology/lane_balls.h"
#include "topology/plain_balls.h"

namespace geocage {
namespace {

geometry::TriangleMesh dented(geometry::TriangleMesh mesh) {
  for (geometry::Vec3& p : mesh.vertices)
    p *= 1 + 0.2 * std::sin(5.3 * p.x() + 0.7 * p.y() - 0.4) * std::cos(4 * p.z() + p.x());
  return mesh;
}

/// The number of fields that are not the plain ones: counts exactly, sums to 1e-9, angles to 1e-7.
int differences(const geometry::TriangleMesh& mesh, double radius_m, topology::Metric metric, int& angles) {
  topology::LaneReport report;
  const auto lane = topology::lane_ball_fields(mesh, {radius_m}, metric, {}, &report).radii.front();
  const auto plain = topology::plain_ball_fields(mesh, {radius_m}, metric).radii.front();
  double defects = 0;
  for (double k : topology::angle_defects_rad(mesh)) defects += std::abs(k);
  int count = 0;
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    count += lane.ball_vertices[v] != plain.ball_vertices[v];
    count += lane.ball_triangles[v] != plain.ball_triangles[v];
    count += lane.euler[v] != plain.euler[v];
    count += !(std::abs(lane.curvature_sum_rad[v] - plain.curvature_sum_rad[v]) <= 1e-9 * defects);
    count += !(std::abs(lane.ball_area_m2[v] - plain.ball_area_m2[v]) <= 1e-9 * plain.ball_area_m2[v]);
    count += !((lane.center[v] - plain.center[v]).norm() <= 1e-9 * radius_m);
    const bool none = std::isnan(lane.winding_angle_rad[v]),
               none_plain = std::isnan(plain.winding_angle_rad[v]);
    angles += none != none_plain ||
              (!none && std::abs(lane.winding_angle_rad[v] - plain.winding_angle_rad[v]) > 1e-7);
  }
  return count;
}

}  // namespace
}  // namespace geocage

int main(int count, char** arguments) {
  using namespace geocage;
  const double share = count > 1 ? std::atof(arguments[1]) : 0.05;
  std::vector<std::pair<std::string, geometry::TriangleMesh>> meshes = {
      {"dented sphere 2.6k", dented(datasets::icosphere(1, 4))},
      {"dented sphere 10k", dented(datasets::icosphere(1, 5))},
      {"dented sphere 41k", dented(datasets::icosphere(1, 6))},
      {"dented torus 3k", dented(datasets::torus(1, 0.3, 100, 30))},
      {"dented torus 20k", dented(datasets::torus(1, 0.3, 260, 78))},
      {"dented torus 100k", dented(datasets::torus(1, 0.3, 578, 173))},
      {"torus", datasets::torus(1, 0.3, 120, 36)},
      {"cup", datasets::cup(0.04, 0.1, 0.003, 96)},
      {"capped cylinder", datasets::capped_cylinder(1, 2, 64)},
      {"dented box", dented(datasets::box({1, 2, 3}, 16))},
      {"flat grid", datasets::flat_grid(1, 40)},
      {"open tube", datasets::open_tube(1, 2, 64, 30)}};
  for (int i = 2; i < count; ++i) meshes.emplace_back(arguments[i], geometry::read_mesh(arguments[i]));
  int all = 0;
  for (const auto& [name, mesh] : meshes)
    for (const auto metric : {topology::Metric::hop, topology::Metric::dijkstra}) {
      int angles = 0;
      const int found = differences(mesh, share * check_mesh(mesh).diagonal_m(), metric, angles);
      fmt::print("{} {}: {} vertices, {} differ, {} winding angles\n", name,
                 metric == topology::Metric::hop ? "hop" : "dijkstra", mesh.vertices.size(), found, angles);
      all += found + angles;
    }
  return all > 0;
}
