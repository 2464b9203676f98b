#include "geometry/cloud_files.h"

#include <set>

#include <fmt/format.h>
#include <pcl/PCLPointCloud2.h>
#include <pcl/console/print.h>
#include <pcl/io/pcd_io.h>
#include <pcl/io/ply_io.h>

#include "geometry/cloud_text.h"
#include "geometry/file_guards.h"
#include "pipeline/error.h"

namespace geocage::geometry {

namespace fs = std::filesystem;
using pipeline::Fault;
using pipeline::UserError;

namespace {

const std::set<std::string> text_endings = {".xyz", ".txt", ".asc", ".csv"};

[[noreturn]] void refuse(const fs::path& file, const std::string& sentence) {
  throw UserError(Fault::input, file.string(), sentence, "write the cloud anew with another tool");
}

/// What a file holds, before anything is dropped.
struct Raw {
  std::vector<Vec3> points;
  std::vector<int> labels;
  bool organised = false;
  std::optional<Vec3> sensor;
};

template <class Number>
double as(const std::uint8_t* at) {
  Number x;
  std::memcpy(&x, at, sizeof x);
  return static_cast<double>(x);
}

double number_at(const std::uint8_t* at, std::uint8_t type) {
  using Field = pcl::PCLPointField;
  switch (type) {
    case Field::INT8:
      return as<std::int8_t>(at);
    case Field::UINT8:
      return as<std::uint8_t>(at);
    case Field::INT16:
      return as<std::int16_t>(at);
    case Field::UINT16:
      return as<std::uint16_t>(at);
    case Field::INT32:
      return as<std::int32_t>(at);
    case Field::UINT32:
      return as<std::uint32_t>(at);
    case Field::FLOAT32:
      return as<float>(at);
    default:
      return as<double>(at);
  }
}

const pcl::PCLPointField* field_named(const pcl::PCLPointCloud2& blob, const std::string& name) {
  for (const auto& field : blob.fields)
    if (field.name == name) return &field;
  return nullptr;
}

/// PCL's own conversion takes only single precision and leaves other types unset.
Raw unpacked(const fs::path& file, const pcl::PCLPointCloud2& blob) {
  Raw raw;
  raw.organised = blob.height > 1;
  const pcl::PCLPointField* axes[3];
  for (int k = 0; k < 3; ++k) {
    axes[k] = field_named(blob, std::string(1, static_cast<char>('x' + k)));
    if (!axes[k]) refuse(file, fmt::format("it has no field '{}'", static_cast<char>('x' + k)));
  }
  const auto* label = field_named(blob, "label");
  const std::size_t count = std::size_t(blob.width) * blob.height;
  if (blob.data.size() < count * blob.point_step) refuse(file, "it holds fewer points than its header says");
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint8_t* row = blob.data.data() + i * blob.point_step;
    Vec3& p = raw.points.emplace_back();
    for (int k = 0; k < 3; ++k) p[k] = number_at(row + axes[k]->offset, axes[k]->datatype);
    if (label) raw.labels.push_back(static_cast<int>(number_at(row + label->offset, label->datatype)));
  }
  return raw;
}

Raw read_raw(const fs::path& file) {
  const std::string ending = ending_of(file);
  if (text_endings.contains(ending)) {
    Raw raw;
    raw.points = read_text_points(file);
    return raw;
  }
  pcl::console::setVerbosityLevel(pcl::console::L_ALWAYS);
  pcl::PCLPointCloud2 blob;
  Eigen::Vector4f origin = Eigen::Vector4f::Zero();
  Eigen::Quaternionf orientation;
  int answer = 0, version = 0;
  if (ending == ".pcd") {
    guard_pcd(file);
    answer = pcl::PCDReader().read(file.string(), blob, origin, orientation, version);
  } else if (ending == ".ply") {
    guard_ply(file);
    answer = pcl::PLYReader().read(file.string(), blob, origin, orientation, version);
  } else {
    refuse(file, "no cloud is read from files that end in '" + ending + "'");
  }
  if (answer < 0) refuse(file, "no cloud can be read from it");
  Raw raw = unpacked(file, blob);
  if (ending == ".pcd") raw.sensor = origin.head<3>().cast<double>();
  return raw;
}

bool among(const Vec3& p, const std::vector<Vec3>& points) {
  Vec3 low = points.front(), high = points.front();
  for (const Vec3& q : points) {
    low = low.cwiseMin(q);
    high = high.cwiseMax(q);
  }
  return (p.array() >= low.array()).all() && (p.array() <= high.array()).all();
}

}  // namespace

bool is_cloud_ending(const std::string& ending) {
  return ending == ".pcd" || ending == ".ply" || text_endings.contains(ending);
}

bool is_cloud_file(const fs::path& file) {
  const std::string ending = ending_of(file);
  if (ending != ".ply") return is_cloud_ending(ending);
  try {
    return guard_ply(file).faces == 0;
  } catch (const UserError&) {
    return false;  // the mesh reader will say what is wrong
  }
}

PointCloud read_cloud(const fs::path& file, double scale_to_m, int* dropped) {
  guard_file(file);
  const Raw raw = read_raw(file);
  PointCloud cloud;
  for (std::size_t i = 0; i < raw.points.size(); ++i) {
    if (!raw.points[i].allFinite()) continue;
    cloud.points.push_back(scale_to_m * raw.points[i]);
    if (!raw.labels.empty()) cloud.label.push_back(raw.labels[i]);
  }
  const std::size_t lost = raw.points.size() - cloud.size();
  if (!raw.organised && lost * 5 > raw.points.size())  // in an organised cloud, the sensor saw nothing there
    refuse(file, fmt::format("{} of {} points are not finite", lost, raw.points.size()));
  if (cloud.size() < 4) refuse(file, fmt::format("it holds {} points, fewer than 4", cloud.size()));
  if (dropped) *dropped = static_cast<int>(lost);
  if (raw.sensor && !among(scale_to_m * *raw.sensor, cloud.points)) {
    cloud.sensor_origins = {scale_to_m * *raw.sensor};
    cloud.view.assign(cloud.size(), 0);
  }
  return cloud;
}

}  // namespace geocage::geometry
