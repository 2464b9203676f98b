#include "tests/bench/score_noise/measure.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <functional>

#include <fmt/format.h>

#include "geometry/noise.h"
#include "geometry/source_file.h"
#include "stages/import/import.h"
#include "stages/remesh/remesh.h"
#include "topology/agreement.h"
#include "topology/balls.h"

namespace geocage::study {

using geometry::NoiseDirection;
using geometry::TriangleMesh;
using topology::Metric;

namespace {

/// One field of one mesh; local ones have no radius and no metric.
struct NamedField {
  std::string name, metric;
  double radius_m, share;  ///< share: of the surface that the median ball holds
  std::vector<double> values;
};

std::vector<NamedField> fields_of(const TriangleMesh& mesh, const std::vector<double>& radii_m) {
  const double area = geometry::check_mesh(mesh).area_m2;
  std::vector<NamedField> fields;
  for (Metric metric : {Metric::hop, Metric::dijkstra})
    for (auto& ball : topology::ball_fields(mesh, radii_m, metric).radii) {
      const std::string name = metric == Metric::hop ? "hop" : "dijkstra";
      const double share = topology::median_share(ball, area);
      fields.push_back({"winding", name, ball.radius_m, share, std::move(ball.winding_angle_rad)});
      fields.push_back({"curvature", name, ball.radius_m, share, std::move(ball.curvature_sum_rad)});
    }
  fields.push_back({"angle_defect", "", 0, 0, topology::angle_defects_rad(mesh)});
  fields.push_back({"jet_product", "", 0, 0, jet_curvature_products(mesh)});
  return fields;
}

/// What a noisy field is compared with.
struct Clean {
  NamedField field;
  std::vector<int> top;
  std::vector<double> from_best_m;
};

/// Mean, over the vertices where the noisy field is largest, of the way to the nearest clean best.
double drift_m(const Clean& clean, const std::vector<double>& noisy) {
  double sum = 0;
  const auto best = topology::largest(noisy);
  for (int v : best) sum += clean.from_best_m[v];
  return sum / static_cast<double>(best.size());
}

double share_where(const std::vector<double>& values, const std::function<bool(double)>& is) {
  return static_cast<double>(std::count_if(values.begin(), values.end(), is)) /
         static_cast<double>(values.size());
}

TriangleMesh pipeline_mesh(const std::filesystem::path& file, const std::string& unit, double edge_length_m) {
  pipeline::Run run;
  stages::ImportParams import;
  import.unit = unit;
  stages::RemeshParams remesh;
  remesh.edge_length_m = edge_length_m;
  return stages::remesh(remesh, run, stages::import_mesh(import, run, geometry::SourceFile{file}));
}

}  // namespace

void measure(const std::filesystem::path& file, const std::string& unit, const MeasureOptions& options,
             const std::filesystem::path& csv) {
  const TriangleMesh mesh = pipeline_mesh(file, unit, options.edge_length_m);
  const double edge_m = geometry::mean_edge_m(mesh);
  std::vector<Clean> clean;
  for (auto& field : fields_of(mesh, options.radii_m)) {
    auto top = topology::top_set(field.values, 0.1);
    auto from_best = topology::ways_from(topology::largest(field.values), mesh);
    clean.push_back({std::move(field), std::move(top), std::move(from_best)});
  }
  std::ofstream out(csv);
  out << "object,vertices,field,metric,radius_m,median_share,ring_share,no_axis_share,direction,sigma_edges,"
         "seed,spearman,overlap,drift_m\n";
  for (const auto direction : {NoiseDirection::normal, NoiseDirection::isotropic})
    for (double sigma : options.sigmas_edges)
      for (int seed = 1; seed <= options.seeds; ++seed) {
        const auto noisy =
            fields_of(with_vertex_noise(mesh, sigma * edge_m, direction, seed), options.radii_m);
        for (std::size_t i = 0; i < clean.size(); ++i) {
          const NamedField& field = clean[i].field;
          out << fmt::format("{},{},{},{},{},{},{},{},{},{},{},{},{},{}\n", file.stem().string(),
                             mesh.vertices.size(), field.name, field.metric, field.radius_m, field.share,
                             share_where(field.values, [](double x) { return x == 2 * M_PI; }),
                             share_where(field.values, [](double x) { return std::isnan(x); }),
                             direction == NoiseDirection::normal ? "normal" : "isotropic", sigma, seed,
                             topology::rank_correlation(field.values, noisy[i].values),
                             topology::overlap(clean[i].top, topology::top_set(noisy[i].values, 0.1)),
                             drift_m(clean[i], noisy[i].values));
        }
        out.flush();
      }
}

}  // namespace geocage::study
