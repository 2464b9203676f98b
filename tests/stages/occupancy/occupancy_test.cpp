#include "stages/occupancy/occupancy.h"

#include <fstream>

#include <gtest/gtest.h>
#include <omp.h>

#include "tests/pipeline/scratch_folder.h"

namespace geocage::stages {
namespace {

using geometry::Space;
using geometry::space_at;
using geometry::Vec3;

/// A wall at x = 0.3 m, 10 cm wide, seen from the origin.
geometry::PointCloud wall() {
  geometry::PointCloud cloud;
  cloud.sensor_origins = {Vec3::Zero()};
  for (int y = -25; y <= 25; ++y)
    for (int z = -25; z <= 25; ++z) cloud.points.emplace_back(0.3, 0.002 * y, 0.002 * z);
  cloud.view.assign(cloud.size(), 0);
  return cloud;
}

TEST(Occupancy, FreeBeforeOccupiedAtUnknownBehind) {
  pipeline::Run run;
  const auto map = occupancy({.resolution_m = 0.005}, run, wall());
  EXPECT_EQ(space_at(map, {0.15, 0.001, 0.001}), Space::free);
  EXPECT_EQ(space_at(map, {0.28, 0.01, -0.02}), Space::free);
  EXPECT_EQ(space_at(map, {0.3025, 0.001, 0.001}), Space::occupied);
  EXPECT_EQ(space_at(map, {0.32, 0.001, 0.001}), Space::unknown);
  EXPECT_EQ(space_at(map, {0.15, 0.1, 0}), Space::unknown);  // beside the view
  // The wall is 20 x 20 cells; those at its edges may be cut.
  EXPECT_NEAR(run.metrics().at("occupied_cells"), 441, 60);
  // A pyramid of 0.3 m on 0.1 m x 0.1 m holds 8000 cells of 5 mm; its sides, 0.06 m2, cut up to 2400 more.
  EXPECT_GE(run.metrics().at("free_cells"), 8000 - 441);
  EXPECT_LE(run.metrics().at("free_cells"), 8000 + 2400);
}

TEST(Occupancy, LeavesTheNumberOfThreadsAlone) {
  omp_set_num_threads(3);
  pipeline::Run run;
  occupancy({}, run, wall());
  EXPECT_EQ(omp_get_max_threads(), 3);
}

TEST(Occupancy, ReadsBackAndIsAnOctoMap) {
  pipeline::Run run;
  const auto map = occupancy({.resolution_m = 0.01}, run, wall());
  const tests::ScratchFolder folder, again;
  save_artefact(map, folder.path());
  geometry::Occupancy read;
  load_artefact(read, folder.path());
  EXPECT_EQ(geometry::count_cells(read).free, geometry::count_cells(map).free);
  EXPECT_EQ(geometry::count_cells(read).occupied, geometry::count_cells(map).occupied);
  EXPECT_EQ(space_at(read, {0.305, 0.001, 0.001}), Space::occupied);
  save_artefact(read, again.path());
  const auto bytes = [](const std::filesystem::path& file) {
    std::ifstream in(file, std::ios::binary);
    return std::string(std::istreambuf_iterator<char>(in), {});
  };
  EXPECT_EQ(bytes(folder / "occupancy.bt"), bytes(again / "occupancy.bt"));
}

}  // namespace
}  // namespace geocage::stages
