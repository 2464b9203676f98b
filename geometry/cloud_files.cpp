#include "geometry/cloud_files.h"

#include <fstream>
#include <sstream>

#include <pcl/console/print.h>
#include <pcl/io/pcd_io.h>
#include <pcl/io/ply_io.h>

#include "geometry/file_guards.h"
#include "pipeline/error.h"

namespace geocage::geometry {

namespace fs = std::filesystem;
using pipeline::Fault;
using pipeline::UserError;

namespace {

using Points = pcl::PointCloud<pcl::PointXYZ>;

[[noreturn]] void refuse(const fs::path& file, const std::string& sentence) {
  throw UserError(Fault::input, file.string(), sentence, "write the cloud anew with another tool");
}

/// A PCD header that promises more points than a guard allows never reaches the reader.
void guard_pcd(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::uint64_t points = 0;
  bool data = false;
  std::string line;
  for (int i = 0; i < 100 && !data && std::getline(in, line); ++i) {
    std::istringstream words(line);
    std::string word;
    words >> word;
    if (word == "POINTS") words >> points;
    data = word == "DATA";
  }
  if (!data) refuse(file, "its header has no DATA line: this is not a PCD file");
  if (points > 5 * most_faces) refuse(file, "its header promises more than 50 million points");
}

Points read_xyz(const fs::path& file) {
  std::ifstream in(file);
  Points points;
  std::string line;
  for (int number = 1; std::getline(in, line); ++number) {
    for (char& c : line)
      if (c == ',' || c == ';' || c == '\r') c = ' ';
    if (line.find_first_not_of(' ') == std::string::npos || line[0] == '#') continue;
    std::istringstream words(line);
    std::string x, y, z;
    words >> x >> y >> z;
    char* end[3];
    const float p[3] = {std::strtof(x.c_str(), &end[0]), std::strtof(y.c_str(), &end[1]),
                        std::strtof(z.c_str(), &end[2])};
    if (z.empty() || *end[0] || *end[1] || *end[2])
      refuse(file, "line " + std::to_string(number) + " holds no three numbers");
    points.emplace_back(p[0], p[1], p[2]);
  }
  points.height = 1;
  points.width = static_cast<std::uint32_t>(points.size());
  return points;
}

}  // namespace

bool is_cloud_file(const fs::path& file) {
  const std::string ending = ending_of(file);
  if (ending == ".pcd" || ending == ".xyz") return true;
  if (ending != ".ply") return false;
  try {
    return guard_ply(file).faces == 0;
  } catch (const UserError&) {
    return false;  // the mesh reader will say what is wrong
  }
}

PointCloud read_cloud(const fs::path& file, double scale_to_m, int* dropped) {
  guard_file(file);
  pcl::console::setVerbosityLevel(pcl::console::L_ALWAYS);
  const std::string ending = ending_of(file);
  Points points;
  int answer = 0;
  bool sensor_known = false;
  if (ending == ".pcd") {
    guard_pcd(file);
    answer = pcl::io::loadPCDFile(file.string(), points);
    sensor_known = true;
  } else if (ending == ".ply") {
    guard_ply(file);
    answer = pcl::io::loadPLYFile(file.string(), points);
  } else if (ending == ".xyz") {
    points = read_xyz(file);
  } else {
    refuse(file, "no cloud is read from files that end in '" + ending + "'");
  }
  if (answer < 0) refuse(file, "no cloud can be read from it");

  PointCloud cloud;
  int lost = 0;
  for (const auto& p : points) {
    const Vec3 q(p.x, p.y, p.z);
    if (q.allFinite())
      cloud.points.push_back(scale_to_m * q);
    else
      ++lost;
  }
  const bool organised = points.height > 1;  // there NaN means that the sensor saw nothing
  if (!organised && lost * 5 > static_cast<int>(points.size()))
    refuse(file, std::to_string(lost) + " of " + std::to_string(points.size()) + " points are not finite");
  if (cloud.size() < 4) refuse(file, "it holds " + std::to_string(cloud.size()) + " points, fewer than 4");
  if (dropped) *dropped = lost;
  if (sensor_known) {
    cloud.sensor_origins = {scale_to_m * points.sensor_origin_.head<3>().cast<double>()};
    cloud.view.assign(cloud.size(), 0);
  }
  return cloud;
}

}  // namespace geocage::geometry
