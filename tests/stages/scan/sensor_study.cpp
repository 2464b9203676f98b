// The measures of plane_noise.h of real table planes and of the virtual Kinect before planes alike:
//   build/release/sensor_study [FOLDER of labelled scans, whose label 1 is the table]
#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "datasets/shapes.h"
#include "geometry/cloud_files.h"
#include "pipeline/error.h"
#include "stages/scan/scan.h"
#include "tests/stages/scan/plane_noise.h"

namespace fs = std::filesystem;
using namespace geocage;
using geometry::Vec3;

namespace {

void print_row(const std::string& what, const tests::Points& from_sensor) {
  const auto noise = tests::plane_noise(from_sensor);
  std::vector<double> depth;
  for (const Vec3& p : from_sensor) depth.push_back(std::abs(p.z()));
  fmt::print("| {} | {:.0f} | {:.2f} | {:.2f} | {:.2f} | {:.2f} | {:.2f} |\n", what,
             noise.incidence_rad * 180 / M_PI, geometry::median(depth), 1e3 * noise.local_rms_m,
             1e3 * noise.whole_rms_m, 1e3 * noise.spacing_m, 1e3 * noise.spacing_rad);
}

void print_real(const fs::path& file) {
  const auto cloud = geometry::read_cloud(file);
  tests::Points table;
  for (std::size_t i = 0; i < cloud.label.size(); ++i)
    if (cloud.label[i] == 1) table.push_back(cloud.points[i]);
  if (table.size() < 10000) return;
  const auto plane = tests::fitted_plane(table);
  std::erase_if(table, [&](const Vec3& p) { return std::abs(plane.height_m(p)) > 0.01; });
  if (!cloud.sensor_origins.empty())
    for (Vec3& p : table) p -= cloud.sensor_origins.front();
  print_row("real, " + file.stem().string(), table);
}

/// A square table of 0.7 m before the virtual sensor, leaning.
void print_virtual(double range_m, double lean_deg, double warp_rad, std::uint64_t seed) {
  auto mesh = datasets::flat_grid(0.7, 1);
  for (Vec3& p : mesh.vertices) p = Eigen::AngleAxisd(lean_deg * M_PI / 180, Vec3::UnitX()) * p;
  pipeline::Run run;
  const auto cloud = stages::scan({.placement = "list",
                                   .positions_m = {0, 0, range_m},
                                   .width = 640,
                                   .height = 480,
                                   .intrinsics = "matrix",
                                   .noise = {"kinect"},
                                   .warp_rad = warp_rad,
                                   .seed = seed},
                                  run, mesh);
  tests::Points from_sensor;
  for (const Vec3& p : cloud.points) from_sensor.push_back(p - Vec3(0, 0, range_m));
  print_row(fmt::format("virtual, warp_rad {}, seed {}", warp_rad, seed), from_sensor);
}

}  // namespace

int main(int argc, char** argv) {
  fmt::print(
      "| plane | lean / deg | median depth / m | local rms / mm | whole rms / mm | spacing / mm | spacing / "
      "mrad "
      "|\n|---|---|---|---|---|---|---|\n");
  try {
    std::vector<fs::path> files;
    if (argc > 1)
      for (const auto& entry : fs::directory_iterator(argv[1]))
        if (entry.path().extension() == ".pcd") files.push_back(entry.path());
    std::sort(files.begin(), files.end());
    for (const auto& file : files) print_real(file);
    const double usual = stages::ScanParams().warp_rad;
    for (std::uint64_t seed : {1, 2, 3}) print_virtual(0.8, 0, usual, seed);
    for (std::uint64_t seed : {1, 2, 3}) print_virtual(0.93, 56, usual, seed);
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 1;
  }
}
