#include <cerrno>
#include <fstream>
#include <system_error>

#include <nlohmann/json.hpp>

#include "pipeline/text_file.h"
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

json read_json(const fs::path& file) {
  std::ifstream in(file);
  if (!in) throw std::system_error(errno, std::generic_category(), file.string());
  return json::parse(in);
}

}  // namespace

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
    pipeline::write_text(dir / file, bytes);
    list.push_back({{"radius_m", ball.radius_m},
                    {"file", file},
                    {"vertices", ball.euler.size()},
                    {"columns_f64", names}});
  }
  pipeline::write_text(dir / "balls.json",
                       json{{"schema", "geocage-balls 1"}, {"radii", list}}.dump(1) + "\n");
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

}  // namespace geocage::topology
