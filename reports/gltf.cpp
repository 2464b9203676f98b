#include "reports/gltf.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstring>

namespace geocage::reports {

using geometry::Pose;
using geometry::Vec3;
using nlohmann::json;

namespace {

// Of the specification, section 5.1: component types and buffer targets.
constexpr int byte_type = 5121, short_type = 5123, int_type = 5125, float_type = 5126;
constexpr int vertex_target = 34962, index_target = 34963;
constexpr int points_mode = 0, triangles_mode = 4;
constexpr std::uint16_t nan_code = 65535;

json vector3(const Vec3& p) {
  return {p.x(), p.y(), p.z()};
}

/// glTF orders x y z w.
json quaternion(const Pose& pose) {
  const Eigen::Quaterniond q(pose.linear());
  return {q.x(), q.y(), q.z(), q.w()};
}

std::string attribute_of(const std::string& name) {
  std::string attribute = "_";
  for (const unsigned char c : name) attribute += std::isalnum(c) ? static_cast<char>(std::toupper(c)) : '_';
  return attribute;
}

}  // namespace

template <class T>
void Gltf::put(T value) {
  const std::size_t at = bytes_.size();
  bytes_.resize(at + sizeof value);
  std::memcpy(bytes_.data() + at, &value, sizeof value);  // x86 and ARM are little-endian, as glTF is
}

void Gltf::align() {
  bytes_.resize((bytes_.size() + 3) / 4 * 4);
}

int Gltf::add_view(std::size_t start, int stride, int target) {
  json view = {{"buffer", 0}, {"byteOffset", start}, {"byteLength", bytes_.size() - start}};
  if (stride > 0) view["byteStride"] = stride;
  if (target > 0) view["target"] = target;
  views_.push_back(view);
  align();
  return static_cast<int>(views_.size()) - 1;
}

int Gltf::add_accessor(json accessor) {
  accessors_.push_back(std::move(accessor));
  return static_cast<int>(accessors_.size()) - 1;
}

int Gltf::add_node(const std::string& name, int parent, const Pose& X_PN, json extras) {
  const int index = static_cast<int>(nodes_.size());
  json node = {{"name", name}};
  if (!X_PN.translation().isZero(0)) node["translation"] = vector3(X_PN.translation());
  if (!X_PN.linear().isIdentity(0)) node["rotation"] = quaternion(X_PN);
  if (!extras.is_null()) node["extras"] = std::move(extras);
  nodes_.push_back(node);
  if (parent < 0)
    roots_.push_back(index);
  else
    nodes_[parent]["children"].push_back(index);
  return index;
}

int Gltf::add_positions(const std::vector<Vec3>& points, int node, int& child) {
  Vec3 low = Vec3::Zero(), high = Vec3::Zero();
  if (!points.empty()) low = high = points.front();
  for (const Vec3& p : points) low = low.cwiseMin(p), high = high.cwiseMax(p);
  const double step = std::max((high - low).maxCoeff(), 1e-9) / 65535;
  const std::size_t start = bytes_.size();
  std::array<int, 3> least = {65535, 65535, 65535}, most = {0, 0, 0};
  for (const Vec3& p : points) {
    for (int k = 0; k < 3; ++k) {
      const auto code = static_cast<std::uint16_t>(std::lround((p[k] - low[k]) / step));
      put(code);
      least[k] = std::min(least[k], int{code}), most[k] = std::max(most[k], int{code});
    }
    put(std::uint16_t{0});
  }
  child = add_node(nodes_[node]["name"].get<std::string>() + ".shape", node, Pose::Identity());
  nodes_[child]["translation"] = vector3(low);
  nodes_[child]["scale"] = {step, step, step};
  return add_accessor({{"bufferView", add_view(start, 8, vertex_target)},
                       {"componentType", short_type},
                       {"count", points.size()},
                       {"type", "VEC3"},
                       {"min", least},
                       {"max", most}});
}

int Gltf::add_field(const GltfField& field, json& told) {
  double low = HUGE_VAL, high = -HUGE_VAL;
  for (const double x : field.values)
    if (std::isfinite(x)) low = std::min(low, x), high = std::max(high, x);
  if (low > high) low = 0, high = 1;
  const double step = high > low ? (high - low) / (nan_code - 1) : 1;
  const std::size_t start = bytes_.size();
  for (const double x : field.values) {
    put(std::isfinite(x) ? static_cast<std::uint16_t>(std::lround((x - low) / step)) : nan_code);
    put(std::uint16_t{0});
  }
  told.push_back({{"attribute", attribute_of(field.name)},
                  {"name", field.name},
                  {"title", field.title},
                  {"unit", field.unit},
                  {"low", low},
                  {"high", high}});
  return add_accessor({{"bufferView", add_view(start, 4, vertex_target)},
                       {"componentType", short_type},
                       {"count", field.values.size()},
                       {"type", "SCALAR"}});
}

int Gltf::add_material(const Colour& colour, bool by_vertex) {
  const Colour base = by_vertex ? Colour::Ones() : colour;
  const json material = {{"pbrMetallicRoughness",
                          {{"baseColorFactor", {base[0], base[1], base[2], 1.0}},
                           {"metallicFactor", 0.0},
                           {"roughnessFactor", 0.8}}}};
  const auto known = std::find(materials_.begin(), materials_.end(), material);
  if (known != materials_.end()) return static_cast<int>(known - materials_.begin());
  materials_.push_back(material);
  return static_cast<int>(materials_.size()) - 1;
}

void Gltf::add_primitive(int node, json primitive, json extras) {
  if (!extras.is_null()) primitive["extras"] = std::move(extras);
  nodes_[node]["mesh"] = meshes_.size();
  meshes_.push_back({{"primitives", {std::move(primitive)}}});
}

void Gltf::add_surface(int node, const geometry::TriangleMesh& mesh, const std::vector<GltfField>& fields,
                       const std::vector<Colour>& colours, const Colour& colour) {
  int child = node;
  json attributes = {{"POSITION", add_positions(mesh.vertices, node, child)}}, told = json::array();
  for (const GltfField& field : fields) attributes[attribute_of(field.name)] = add_field(field, told);
  if (!colours.empty()) {
    const std::size_t start = bytes_.size();
    for (const Colour& c : colours) {
      for (int k = 0; k < 3; ++k)
        put(static_cast<std::uint8_t>(std::lround(255 * std::clamp(c[k], 0.0, 1.0))));
      put(std::uint8_t{255});
    }
    attributes["COLOR_0"] = add_accessor({{"bufferView", add_view(start, 4, vertex_target)},
                                          {"componentType", byte_type},
                                          {"normalized", true},
                                          {"count", colours.size()},
                                          {"type", "VEC4"}});
  }
  const bool small = mesh.vertices.size() < 65535;  // the greatest index is kept for primitive restart
  const std::size_t start = bytes_.size();
  for (const auto& triangle : mesh.triangles)
    for (const int v : triangle)
      if (small)
        put(static_cast<std::uint16_t>(v));
      else
        put(static_cast<std::uint32_t>(v));
  const int indices = add_accessor({{"bufferView", add_view(start, 0, index_target)},
                                    {"componentType", small ? short_type : int_type},
                                    {"count", 3 * mesh.triangles.size()},
                                    {"type", "SCALAR"}});
  add_primitive(child,
                {{"attributes", attributes},
                 {"indices", indices},
                 {"mode", triangles_mode},
                 {"material", add_material(colour, !colours.empty())}},
                told.empty() ? json() : json{{"fields", told}});
}

void Gltf::add_points(int node, const std::vector<Vec3>& points, const Colour& colour) {
  int child = node;
  const int positions = add_positions(points, node, child);
  add_primitive(child,
                {{"attributes", {{"POSITION", positions}}},
                 {"mode", points_mode},
                 {"material", add_material(colour, false)}},
                {});
}

int Gltf::add_floats(const std::vector<float>& values, int width, bool with_range) {
  const std::size_t start = bytes_.size();
  for (const float x : values) put(x);
  json accessor = {{"bufferView", add_view(start, 0, 0)},
                   {"componentType", float_type},
                   {"count", values.size() / width},
                   {"type", width == 1   ? "SCALAR"
                            : width == 3 ? "VEC3"
                                         : "VEC4"}};
  if (with_range) accessor["min"] = {values.front()}, accessor["max"] = {values.back()};
  return add_accessor(accessor);
}

void Gltf::add_animation(const std::string& name, const std::vector<double>& times_s,
                         const std::vector<Motion>& motions) {
  if (times_s.empty() || motions.empty()) return;
  const int input = add_floats({times_s.begin(), times_s.end()}, 1, true);
  json samplers = json::array(), channels = json::array();
  for (const Motion& motion : motions) {
    std::vector<float> places, turns;
    Eigen::Quaterniond before = Eigen::Quaterniond::Identity();
    for (const Pose& X : motion.X_PN) {
      Eigen::Quaterniond q(X.linear());
      if (q.dot(before) < 0) q.coeffs() *= -1;  // the short way round between keys
      before = q;
      for (int k = 0; k < 3; ++k) places.push_back(static_cast<float>(X.translation()[k]));
      for (const double c : {q.x(), q.y(), q.z(), q.w()}) turns.push_back(static_cast<float>(c));
    }
    for (const auto& [path, output] : {std::pair{"translation", add_floats(places, 3, false)},
                                       {"rotation", add_floats(turns, 4, false)}}) {
      channels.push_back({{"sampler", samplers.size()}, {"target", {{"node", motion.node}, {"path", path}}}});
      samplers.push_back({{"input", input}, {"output", output}, {"interpolation", "LINEAR"}});
    }
  }
  animations_.push_back({{"name", name}, {"samplers", samplers}, {"channels", channels}});
}

std::vector<std::uint8_t> Gltf::glb() const {
  json all = {{"asset", {{"version", "2.0"}, {"generator", "geocage"}}},
              {"scene", 0},
              {"scenes", {{{"nodes", roots_}}}},
              {"nodes", nodes_},
              {"extensionsUsed", {"KHR_mesh_quantization"}},
              {"extensionsRequired", {"KHR_mesh_quantization"}}};
  for (const auto& [name, list] : {std::pair{"meshes", &meshes_},
                                   {"accessors", &accessors_},
                                   {"bufferViews", &views_},
                                   {"materials", &materials_},
                                   {"animations", &animations_}})
    if (!list->empty()) all[name] = *list;
  if (!bytes_.empty()) all["buffers"] = {{{"byteLength", bytes_.size()}}};
  std::string text = all.dump(-1, ' ', false, json::error_handler_t::replace);  // names may be no UTF-8
  text.resize((text.size() + 3) / 4 * 4, ' ');
  Gltf file;  // for its `put`
  const auto chunk = [&](std::size_t size, const std::array<char, 4>& type) {
    file.put(static_cast<std::uint32_t>(size));
    file.bytes_.insert(file.bytes_.end(), type.begin(), type.end());
  };
  file.bytes_ = {'g', 'l', 'T', 'F'};
  file.put(std::uint32_t{2});
  file.put(static_cast<std::uint32_t>(12 + 8 + text.size() + (bytes_.empty() ? 0 : 8 + bytes_.size())));
  chunk(text.size(), {'J', 'S', 'O', 'N'});
  file.bytes_.insert(file.bytes_.end(), text.begin(), text.end());
  if (bytes_.empty()) return file.bytes_;
  chunk(bytes_.size(), {'B', 'I', 'N', 0});
  file.bytes_.insert(file.bytes_.end(), bytes_.begin(), bytes_.end());
  return file.bytes_;
}

}  // namespace geocage::reports
