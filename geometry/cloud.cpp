#include "geometry/cloud.h"

#include <cerrno>
#include <cstring>
#include <fstream>
#include <system_error>

#include <nlohmann/json.hpp>

#include "pipeline/text_file.h"

namespace geocage::geometry {

namespace fs = std::filesystem;
using nlohmann::json;

namespace {

json numbers(const Vec3& p) {
  return {p.x(), p.y(), p.z()};
}
Vec3 vector(const json& p) {
  return Vec3(p[0].get<double>(), p[1].get<double>(), p[2].get<double>());
}

void put(std::string& bytes, const Vec3& p) {
  bytes.append(reinterpret_cast<const char*>(p.data()), 3 * sizeof(double));
}
void put(std::string& bytes, int x) {
  bytes.append(reinterpret_cast<const char*>(&x), sizeof x);
}
int take_int(const char*& at) {
  int x;
  std::memcpy(&x, at, sizeof x);
  at += sizeof x;
  return x;
}
Vec3 take(const char*& at) {
  Vec3 p;
  std::memcpy(p.data(), at, 3 * sizeof(double));
  at += 3 * sizeof(double);
  return p;
}

std::string ply_of(const PointCloud& cloud) {
  const bool normals = !cloud.normals.empty(), views = !cloud.view.empty(), labels = !cloud.label.empty();
  std::string bytes = "ply\nformat binary_little_endian 1.0\nelement vertex " + std::to_string(cloud.size()) +
                      "\nproperty double x\nproperty double y\nproperty double z\n";
  if (normals) bytes += "property double nx\nproperty double ny\nproperty double nz\n";
  if (views) bytes += "property int view\n";
  if (labels) bytes += "property int label\n";
  bytes += "end_header\n";
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    put(bytes, cloud.points[i]);
    if (normals) put(bytes, cloud.normals[i]);
    if (views) put(bytes, cloud.view[i]);
    if (labels) put(bytes, cloud.label[i]);
  }
  return bytes;
}

}  // namespace

PointCloud subset(const PointCloud& cloud, const std::vector<int>& chosen) {
  PointCloud part;
  part.sensor_origins = cloud.sensor_origins;
  part.support = cloud.support;
  for (int i : chosen) {
    part.points.push_back(cloud.points[i]);
    if (!cloud.normals.empty()) part.normals.push_back(cloud.normals[i]);
    if (!cloud.view.empty()) part.view.push_back(cloud.view[i]);
    if (!cloud.label.empty()) part.label.push_back(cloud.label[i]);
  }
  return part;
}

double diagonal_m(const std::vector<Vec3>& points) {
  if (points.empty()) return 0;
  Vec3 low = points.front(), high = points.front();
  for (const Vec3& p : points) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  return (high - low).norm();
}

std::string_view artefact_kind(const PointCloud*) {
  return "cloud";
}

void save_artefact(const PointCloud& cloud, const fs::path& dir) {
  pipeline::write_text(dir / "cloud.ply", ply_of(cloud));
  json origins = json::array();
  for (const Vec3& p : cloud.sensor_origins) origins.push_back(numbers(p));
  json meta = {{"schema", "geocage-cloud 1"},
               {"points", cloud.size()},
               {"normals", !cloud.normals.empty()},
               {"views", !cloud.view.empty()},
               {"labels", !cloud.label.empty()},
               {"sensor_origins_m", origins},
               {"support", nullptr}};
  if (cloud.support)
    meta["support"] = {{"normal", numbers(cloud.support->normal)}, {"offset_m", cloud.support->offset_m}};
  pipeline::write_text(dir / "cloud.json", meta.dump(1) + "\n");
}

void load_artefact(PointCloud& cloud, const fs::path& dir) {
  const json meta = json::parse(pipeline::read_text(dir / "cloud.json"));
  const std::string bytes = pipeline::read_text(dir / "cloud.ply");
  const std::size_t count = meta["points"];
  const bool normals = meta["normals"], views = meta["views"], labels = meta["labels"];
  const std::size_t header = bytes.find("end_header\n") + 11,
                    row = 24 + (normals ? 24 : 0) + (views ? 4 : 0) + (labels ? 4 : 0);
  if (bytes.size() != header + count * row)
    throw std::system_error(EIO, std::generic_category(), (dir / "cloud.ply").string());
  cloud = {};
  const char* at = bytes.data() + header;
  for (std::size_t i = 0; i < count; ++i) {
    cloud.points.push_back(take(at));
    if (normals) cloud.normals.push_back(take(at));
    if (views) cloud.view.push_back(take_int(at));
    if (labels) cloud.label.push_back(take_int(at));
  }
  for (const auto& p : meta["sensor_origins_m"]) cloud.sensor_origins.push_back(vector(p));
  if (!meta["support"].is_null())
    cloud.support = Plane{vector(meta["support"]["normal"]), meta["support"]["offset_m"]};
}

}  // namespace geocage::geometry
