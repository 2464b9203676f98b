#include "stages/balls/balls.h"

#include <algorithm>

#include "pipeline/error.h"

namespace geocage::stages {

void BallsParams::visit(pipeline::Fields& f) {
  f("radii_m", radii_m, {1e-4, 10}, "radii of the balls; empty: those of the hand");
  f("metric", metric, {"hop", "dijkstra"},
    "distance on the surface: edges x mean edge length, or lengths of edges");
  f("eigenvalue_ratio", eigenvalue_ratio, {1, 100},
    "the axis of a ball is dominant when its eigenvalue is so many times the next");
  f("section", section, {"plane", "edges"},
    "the path that winds: the cut of the plane with the triangles, or the mesh edges along it");
}

topology::BallSet balls(const BallsParams& params, pipeline::Run& run, const geometry::TriangleMesh& mesh) {
  if (params.radii_m.empty())
    throw pipeline::UserError(pipeline::Fault::configuration, "balls.radii_m", "there are no radii",
                              "name at least one");
  const auto report = geometry::check_mesh(mesh);
  if (!report.closed_manifold())
    throw pipeline::UserError(pipeline::Fault::geometry, "balls",
                              "the mesh is not a closed manifold: " + geometry::flaw(report));
  const auto metric = params.metric == "hop" ? topology::Metric::hop : topology::Metric::dijkstra;
  topology::BallOptions options;
  options.eigenvalue_ratio_guard = params.eigenvalue_ratio;
  if (params.section == "edges") options.section = topology::SectionPath::edges;
  auto set = topology::ball_fields(mesh, params.radii_m, metric, options);
  for (std::size_t i = 0; i < set.radii.size(); ++i)
    run.metric("median_share_" + std::to_string(i), topology::median_share(set.radii[i], report.area_m2));
  return set;
}

}  // namespace geocage::stages
