#include <cerrno>
#include <cmath>
#include <fstream>
#include <system_error>

#include <nlohmann/json.hpp>

#include "pipeline/text_file.h"
#include "topology/scores.h"

namespace geocage::topology {

namespace fs = std::filesystem;
using geometry::VertexField;
using nlohmann::json;

namespace {

json triple(const Vec3& p) {
  return {p.x(), p.y(), p.z()};
}
Vec3 vector(const json& p) {
  return Vec3(p[0].get<double>(), p[1].get<double>(), p[2].get<double>());
}

/// NaN has no number in JSON: it is null.
json number(double x) {
  return std::isfinite(x) ? json(x) : json();
}
double number(const json& x) {
  return x.is_null() ? std::nan("") : x.get<double>();
}

json to_json(const Candidate& c) {
  return {{"vertex", c.vertex},
          {"heuristic", c.heuristic},
          {"score", c.score},
          {"radius_m", c.radius_m},
          {"winding_angle_rad", number(c.winding_angle_rad)},
          {"curvature_sum_rad", c.curvature_sum_rad},
          {"euler", c.euler},
          {"p_m", triple(c.p_O)},
          {"normal", triple(c.n_O)},
          {"center_m", triple(c.center_O)},
          {"axis", triple(c.axis_O)},
          {"com_offset_m", c.com_offset_m},
          {"ring_length_m", number(c.ring_length_m)},
          {"neck_length_m", number(c.neck_length_m)},
          {"beside_winding_angle_rad", number(c.beside_winding_angle_rad)},
          {"beside_curvature_sum_rad", number(c.beside_curvature_sum_rad)}};
}

Candidate candidate_of(const json& c) {
  return {.vertex = c["vertex"],
          .heuristic = c["heuristic"],
          .score = c["score"],
          .radius_m = c["radius_m"],
          .winding_angle_rad = number(c["winding_angle_rad"]),
          .curvature_sum_rad = c["curvature_sum_rad"],
          .euler = c["euler"],
          .p_O = vector(c["p_m"]),
          .n_O = vector(c["normal"]),
          .center_O = vector(c["center_m"]),
          .axis_O = vector(c["axis"]),
          .com_offset_m = c["com_offset_m"],
          .ring_length_m = number(c["ring_length_m"]),
          .neck_length_m = number(c["neck_length_m"]),
          .beside_winding_angle_rad = number(c["beside_winding_angle_rad"]),
          .beside_curvature_sum_rad = number(c["beside_curvature_sum_rad"])};
}

}  // namespace

std::string_view artefact_kind(const Scores*) {
  return "scores";
}

void save_artefact(const Scores& scores, const fs::path& dir) {
  std::vector<VertexField> columns = columns_of(scores.ball);
  if (!scores.mesh.observed.empty()) columns.push_back({"observed", scores.mesh.observed});
  geometry::write_ply(dir / "scores.ply", scores.mesh, columns);
  json list = json::array();
  for (const Candidate& c : scores.candidates) list.push_back(to_json(c));
  const json all = {
      {"schema", "geocage-candidates 1"}, {"radius_m", scores.ball.radius_m}, {"candidates", list}};
  pipeline::write_text(dir / "candidates.json", all.dump(1) + "\n");
}

void load_artefact(Scores& scores, const fs::path& dir) {
  scores = {};
  const fs::path file = dir / "candidates.json";
  std::ifstream in(file);
  if (!in) throw std::system_error(errno, std::generic_category(), file.string());
  const json meta = json::parse(in);
  std::vector<VertexField> columns;
  scores.mesh = geometry::read_own_ply(dir / "scores.ply", &columns);
  scores.ball = ball_of(columns, meta["radius_m"]);
  for (VertexField& column : columns)
    if (column.name == "observed") scores.mesh.observed = std::move(column.values);
  for (const auto& c : meta["candidates"]) scores.candidates.push_back(candidate_of(c));
}

}  // namespace geocage::topology
