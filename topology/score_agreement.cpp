#include "topology/score_agreement.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <numeric>
#include <system_error>

#include <nlohmann/json.hpp>

#include "pipeline/text_file.h"
#include "topology/agreement.h"

namespace geocage::topology {

using geometry::TriangleMesh;

namespace {

/// Which vertex of one mesh stands for which of the other.
struct Matching {
  std::vector<int> noisy_of;  ///< for each clean vertex
  std::vector<int> clean_of;  ///< for each noisy vertex
};

Matching matching(const TriangleMesh& clean, const TriangleMesh& noisy, bool same) {
  if (!same)
    return {nearest_points(clean.vertices, noisy.vertices), nearest_points(noisy.vertices, clean.vertices)};
  Matching all;
  all.noisy_of.resize(clean.vertices.size());
  std::iota(all.noisy_of.begin(), all.noisy_of.end(), 0);
  all.clean_of = all.noisy_of;
  return all;
}

FieldAgreement compare(const std::string& name, const TriangleMesh& mesh, const std::vector<double>& clean,
                       const std::vector<double>& noisy, const Matching& match, double top_share) {
  FieldAgreement found{.field = name};
  const auto clean_best = largest(clean), noisy_best = largest(noisy);
  if (clean_best.empty() || noisy_best.empty()) return found;
  std::vector<double> values;  // the noisy field on the clean mesh
  for (int v : match.noisy_of) values.push_back(noisy[v]);
  found.rank_correlation = rank_correlation(clean, values);
  found.top_overlap = overlap(top_set(clean, top_share), top_set(values, top_share));
  const auto way = ways_from(clean_best, mesh);
  double sum = 0;
  for (int v : noisy_best) sum += way[match.clean_of[v]];
  found.drift_m = sum / static_cast<double>(noisy_best.size());
  return found;
}

nlohmann::json number(double x) {
  return std::isfinite(x) ? nlohmann::json(x) : nlohmann::json();
}
double number(const nlohmann::json& json) {
  return json.is_null() ? std::nan("") : json.get<double>();
}

}  // namespace

std::vector<int> nearest_points(const std::vector<Vec3>& points, const std::vector<Vec3>& others) {
  std::vector<int> order(others.size()), nearest;
  std::iota(order.begin(), order.end(), 0);
  std::ranges::sort(order, [&](int a, int b) {
    return others[a].x() != others[b].x() ? others[a].x() < others[b].x() : a < b;
  });
  const auto x = [&](std::ptrdiff_t i) { return others[order[i]].x(); };
  for (const Vec3& p : points) {
    int best = -1;
    double least2 = std::numeric_limits<double>::infinity();
    const auto look = [&](std::ptrdiff_t i) {
      const int k = order[i];
      const double d2 = (others[k] - p).squaredNorm();
      if (d2 < least2 || (d2 == least2 && k < best)) {
        least2 = d2;
        best = k;
      }
    };
    const auto begin =
        std::ranges::lower_bound(order, p.x(), {}, [&](int k) { return others[k].x(); }) - order.begin();
    // outwards along x, until x alone is farther than the best
    for (auto i = begin; i < std::ssize(order) && (x(i) - p.x()) * (x(i) - p.x()) <= least2; ++i) look(i);
    for (auto i = begin - 1; i >= 0 && (x(i) - p.x()) * (x(i) - p.x()) <= least2; --i) look(i);
    nearest.push_back(best);
  }
  return nearest;
}

ScoreAgreement agreement_of(const Scores& clean, const Scores& noisy, double top_share) {
  ScoreAgreement all;
  all.same_vertices = clean.mesh.vertices.size() == noisy.mesh.vertices.size() &&
                      clean.mesh.triangles == noisy.mesh.triangles;
  all.radius_m = clean.ball.radius_m;
  all.noisy_radius_m = noisy.ball.radius_m;
  const Matching match = matching(clean.mesh, noisy.mesh, all.same_vertices);
  for (std::size_t v = 0; v < match.noisy_of.size(); ++v)
    all.gap_m = std::max(all.gap_m, (clean.mesh.vertices[v] - noisy.mesh.vertices[match.noisy_of[v]]).norm());
  all.fields = {compare("winding", clean.mesh, clean.ball.winding_angle_rad, noisy.ball.winding_angle_rad,
                        match, top_share),
                compare("curvature", clean.mesh, clean.ball.curvature_sum_rad, noisy.ball.curvature_sum_rad,
                        match, top_share)};
  return all;
}

std::string_view artefact_kind(const ScoreAgreement*) {
  return "agreement";
}

void save_artefact(const ScoreAgreement& agreement, const std::filesystem::path& dir) {
  nlohmann::ordered_json json = {{"schema", "geocage-agreement 1"},
                                 {"same_vertices", agreement.same_vertices},
                                 {"gap_m", agreement.gap_m},
                                 {"radius_m", agreement.radius_m},
                                 {"noisy_radius_m", agreement.noisy_radius_m},
                                 {"fields", nlohmann::ordered_json::array()}};
  for (const auto& one : agreement.fields)
    json["fields"].push_back({{"field", one.field},
                              {"rank_correlation", number(one.rank_correlation)},
                              {"top_overlap", number(one.top_overlap)},
                              {"drift_m", number(one.drift_m)}});
  pipeline::write_text(dir / "agreement.json", json.dump(2) + "\n");
}

void load_artefact(ScoreAgreement& agreement, const std::filesystem::path& dir) {
  const auto file = dir / "agreement.json";
  std::ifstream in(file);
  if (!in) throw std::system_error(errno, std::generic_category(), file.string());
  const auto json = nlohmann::json::parse(in);
  json.at("same_vertices").get_to(agreement.same_vertices);
  json.at("gap_m").get_to(agreement.gap_m);
  json.at("radius_m").get_to(agreement.radius_m);
  json.at("noisy_radius_m").get_to(agreement.noisy_radius_m);
  agreement.fields.clear();
  for (const auto& one : json.at("fields"))
    agreement.fields.push_back({one.at("field").get<std::string>(), number(one.at("rank_correlation")),
                                number(one.at("top_overlap")), number(one.at("drift_m"))});
}

}  // namespace geocage::topology
