#include <cerrno>
#include <cmath>
#include <cstring>
#include <fstream>
#include <sstream>
#include <system_error>

#include <nlohmann/json.hpp>

#include "topology/balls.h"

namespace geocage::topology {

namespace fs = std::filesystem;
using geometry::VertexField;
using nlohmann::json;

namespace {

std::vector<double> numbers(const std::vector<int>& counts) {
  return {counts.begin(), counts.end()};
}
std::vector<int> counts(const std::vector<double>& numbers) {
  return {numbers.begin(), numbers.end()};
}
std::vector<double> coordinate(const std::vector<Vec3>& points, int k) {
  std::vector<double> values;
  for (const Vec3& p : points) values.push_back(p[k]);
  return values;
}

/// The fields as named columns, in the order of the command line's contract, then what placement needs.
std::vector<VertexField> columns_of(const BallFields& ball) {
  std::vector<VertexField> columns = {{"winding_angle_rad", ball.winding_angle_rad},
                                      {"curvature_sum_rad", ball.curvature_sum_rad},
                                      {"ball_vertices", numbers(ball.ball_vertices)},
                                      {"ball_triangles", numbers(ball.ball_triangles)},
                                      {"euler", numbers(ball.euler)},
                                      {"ball_area_m2", ball.ball_area_m2}};
  for (int k = 0; k < 3; ++k)
    columns.push_back({std::string("center_") + "xyz"[k], coordinate(ball.center, k)});
  for (int k = 0; k < 3; ++k) columns.push_back({std::string("axis_") + "xyz"[k], coordinate(ball.axis, k)});
  columns.push_back({"accumulated_angle_rad", ball.accumulated_angle_rad});
  return columns;
}

BallFields ball_of(const std::vector<VertexField>& columns, double radius_m) {
  BallFields ball;
  ball.radius_m = radius_m;
  ball.winding_angle_rad = columns[0].values;
  ball.curvature_sum_rad = columns[1].values;
  ball.ball_vertices = counts(columns[2].values);
  ball.ball_triangles = counts(columns[3].values);
  ball.euler = counts(columns[4].values);
  ball.ball_area_m2 = columns[5].values;
  ball.accumulated_angle_rad = columns[12].values;
  for (std::size_t v = 0; v < ball.ball_area_m2.size(); ++v) {
    ball.center.emplace_back(columns[6].values[v], columns[7].values[v], columns[8].values[v]);
    ball.axis.emplace_back(columns[9].values[v], columns[10].values[v], columns[11].values[v]);
  }
  return ball;
}

void write_text(const fs::path& file, const std::string& text) {
  std::ofstream out(file, std::ios::binary);
  out << text;
  if (!out.flush()) throw std::system_error(errno, std::generic_category(), file.string());
}
json read_json(const fs::path& file) {
  std::ifstream in(file);
  if (!in) throw std::system_error(errno, std::generic_category(), file.string());
  return json::parse(in);
}

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

}  // namespace

std::string_view artefact_kind(const BallSet*) {
  return "balls";
}

void save_artefact(const BallSet& set, const fs::path& dir) {
  json list = json::array();
  for (std::size_t i = 0; i < set.radii.size(); ++i) {
    const BallFields& ball = set.radii[i];
    std::string bytes;
    json names = json::array();
    for (const auto& column : columns_of(ball)) {
      names.push_back(column.name);
      bytes.append(reinterpret_cast<const char*>(column.values.data()),
                   column.values.size() * sizeof(double));
    }
    const std::string file = "ball_" + std::to_string(i) + ".bin";
    write_text(dir / file, bytes);
    list.push_back({{"radius_m", ball.radius_m},
                    {"file", file},
                    {"vertices", ball.euler.size()},
                    {"columns_f64", names}});
  }
  write_text(dir / "balls.json", json{{"schema", "geocage-balls 1"}, {"radii", list}}.dump(1) + "\n");
}

void load_artefact(BallSet& set, const fs::path& dir) {
  set = {};
  const json meta = read_json(dir / "balls.json");
  for (const auto& entry : meta["radii"]) {
    const fs::path file = dir / entry["file"].get<std::string>();
    std::ifstream in(file, std::ios::binary);
    std::vector<VertexField> columns;
    for (const auto& name : entry["columns_f64"]) {
      auto& column =
          columns.emplace_back(VertexField{name, std::vector<double>(entry["vertices"].get<std::size_t>())});
      in.read(reinterpret_cast<char*>(column.values.data()),
              static_cast<std::streamsize>(column.values.size() * sizeof(double)));
    }
    if (!in) throw std::system_error(EIO, std::generic_category(), file.string());
    set.radii.push_back(ball_of(columns, entry["radius_m"]));
  }
}

std::string_view artefact_kind(const Scores*) {
  return "scores";
}

void save_artefact(const Scores& scores, const fs::path& dir) {
  geometry::write_ply(dir / "scores.ply", scores.mesh, columns_of(scores.ball));
  json list = json::array();
  for (const Candidate& c : scores.candidates)
    list.push_back({{"vertex", c.vertex},
                    {"heuristic", c.heuristic},
                    {"score", c.score},
                    {"radius_m", c.radius_m},
                    {"winding_angle_rad", number(c.winding_angle_rad)},
                    {"curvature_sum_rad", c.curvature_sum_rad},
                    {"euler", c.euler},
                    {"p_m", triple(c.p_O)},
                    {"normal", triple(c.n_O)},
                    {"center_m", triple(c.center_O)},
                    {"axis", triple(c.axis_O)}});
  write_text(
      dir / "candidates.json",
      json{{"schema", "geocage-candidates 1"}, {"radius_m", scores.ball.radius_m}, {"candidates", list}}.dump(
          1) +
          "\n");
}

void load_artefact(Scores& scores, const fs::path& dir) {
  scores = {};
  const json meta = read_json(dir / "candidates.json");
  std::vector<VertexField> columns;
  scores.mesh = geometry::read_own_ply(dir / "scores.ply", &columns);
  scores.ball = ball_of(columns, meta["radius_m"]);
  for (const auto& c : meta["candidates"])
    scores.candidates.push_back({c["vertex"], c["heuristic"], c["score"], c["radius_m"],
                                 number(c["winding_angle_rad"]), c["curvature_sum_rad"], c["euler"],
                                 vector(c["p_m"]), vector(c["normal"]), vector(c["center_m"]),
                                 vector(c["axis"])});
}

}  // namespace geocage::topology
