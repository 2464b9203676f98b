#include "topology/balls.h"

#include <array>
#include <cmath>

#include "geometry/median.h"
#include "topology/lane_balls.h"
#include "topology/plain_balls.h"

namespace geocage::topology {

using geometry::TriangleMesh;

BallFields BallFields::of_size(std::size_t vertices, double radius_m) {
  BallFields fields;
  fields.radius_m = radius_m;
  for (auto* column : {&fields.curvature_sum_rad, &fields.winding_angle_rad, &fields.accumulated_angle_rad,
                       &fields.ball_area_m2})
    column->resize(vertices);
  for (auto* column : {&fields.ball_vertices, &fields.ball_triangles, &fields.euler})
    column->resize(vertices);
  fields.center.resize(vertices);
  fields.axis.resize(vertices);
  return fields;
}

std::vector<double> angle_defects_rad(const TriangleMesh& mesh) {
  std::vector<std::array<double, 3>> angles(mesh.triangles.size());
#pragma omp parallel for schedule(static)
  for (std::size_t f = 0; f < angles.size(); ++f) {
    const auto& t = mesh.triangles[f];
    Vec3 side[3];  // side i from corner i to the next one
    for (int i = 0; i < 3; ++i) side[i] = mesh.vertices[t[(i + 1) % 3]] - mesh.vertices[t[i]];
    const double twice_area = side[0].cross(side[1]).norm();
    angles[f][0] = std::atan2(twice_area, -side[0].dot(side[2]));
    angles[f][1] = std::atan2(twice_area, -side[1].dot(side[0]));
    angles[f][2] = M_PI - angles[f][0] - angles[f][1];
  }
  std::vector<double> defects(mesh.vertices.size(), 2 * M_PI);
  for (std::size_t f = 0; f < angles.size(); ++f)
    for (int i = 0; i < 3; ++i) defects[mesh.triangles[f][i]] -= angles[f][i];
  return defects;
}

double median_share(const BallFields& ball, double surface_area_m2) {
  return geometry::median(ball.ball_area_m2) / surface_area_m2;
}

BallSet ball_fields(const TriangleMesh& mesh, const std::vector<double>& radii_m, Metric metric,
                    const BallOptions& options) {
  return options.section == SectionPath::plane ? lane_ball_fields(mesh, radii_m, metric, options)
                                               : plain_ball_fields(mesh, radii_m, metric, options);
}

}  // namespace geocage::topology
