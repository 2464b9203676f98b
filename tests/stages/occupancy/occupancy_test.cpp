#include "stages/occupancy/occupancy.h"

#include <fstream>

#include <gtest/gtest.h>
#include <omp.h>

#include "geometry/noise.h"
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

/// The wall with a rod of 12 mm, 20 mm before it, and noise of 4 mm along the rays, 4 points on a square
/// millimetre of a cell's face: 25 for each cell.
geometry::PointCloud noisy_wall_and_rod() {
  geometry::PointCloud cloud;
  cloud.sensor_origins = {Vec3::Zero()};
  geometry::RandomStream random(3, 0);
  for (int y = -50; y <= 50; ++y)
    for (int z = -50; z <= 50; ++z) {
      const double depth = std::abs(y) <= 6 ? 0.28 : 0.3;
      cloud.points.push_back(Vec3(1, 0.001 * y / 0.3, 0.001 * z / 0.3) * (depth + 0.004 * random.normal()));
    }
  cloud.view.assign(cloud.size(), 0);
  return cloud;
}

TEST(Occupancy, NoiseBeforeAWallIsPassedAndARodIsNot) {
  const auto cloud = noisy_wall_and_rod();
  const auto count = [&](double share) {
    pipeline::Run run;
    const auto cells = geometry::occupied_cells(occupancy({.least_end_share = share}, run, cloud));
    std::pair<int, int> noise_and_rod;
    for (const Vec3& p : cells.centers_O) {
      const bool at_rod = std::abs(p.y()) < 0.006;
      // A cell whose middle is 10 mm before the wall: 1.9 to 3.1 deviations, 2.8 % of the rays.
      if (!at_rod && std::abs(p.y()) > 0.015) noise_and_rod.first += p.x() < 0.291;
      if (at_rod) noise_and_rod.second += std::abs(p.x() - 0.28) < 0.005;
    }
    return noise_and_rod;
  };
  const auto all = count(0), kept = count(0.2);
  EXPECT_GT(all.first, 30);
  EXPECT_LE(kept.first, all.first / 10);
  // Two or three columns of cells by 19 or 20 rows, two cells deep about the rod's middle, where a third and
  // more end.
  EXPECT_GT(kept.second, 40);
  EXPECT_GE(kept.second, all.second * 0.9);
}

TEST(Occupancy, WithoutNoiseTheShareChangesNothing) {
  pipeline::Run run;
  const auto plain = geometry::occupied_cells(occupancy({}, run, wall())),
             asked = geometry::occupied_cells(occupancy({.least_end_share = 0.2}, run, wall()));
  EXPECT_EQ(plain.centers_O, asked.centers_O);
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
