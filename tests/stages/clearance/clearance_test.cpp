#include "stages/clearance/clearance.h"

#include <cmath>

#include <gtest/gtest.h>
#include <octomap/octomap.h>

#include "datasets/shapes.h"
#include "geometry/noise.h"
#include "pipeline/error.h"
#include "tests/pipeline/scratch_folder.h"

namespace geocage::stages {
namespace {

using geometry::Vec3;

constexpr double h = 0.01;

/// A map of n^3 cells from the origin on, each occupied with the probability `share`, else free or unknown.
geometry::Occupancy random_map(int n, double share) {
  geometry::Occupancy map{std::make_shared<octomap::OcTree>(h)};
  geometry::RandomStream random(5, 0);
  for (int x = 0; x < n; ++x)
    for (int y = 0; y < n; ++y)
      for (int z = 0; z < n; ++z) {
        const double lot = random.uniform();
        const octomap::point3d center((x + 0.5F) * h, (y + 0.5F) * h, (z + 0.5F) * h);
        if (lot < share || lot > 0.5) map.tree->updateNode(center, lot < share);
      }
  return map;
}

bool solid(const geometry::Occupancy& map, const Vec3& p, bool unknown_is_solid) {
  const auto space = geometry::space_at(map, p);
  return space == geometry::Space::occupied || (unknown_is_solid && space == geometry::Space::unknown);
}

// Nodes are floats of numbers below 1 m: 6e-8 m.
TEST(Clearance, NodesAreThoseOfBruteForce) {
  const auto map = random_map(12, 0.02);
  for (const char* unknown : {"open", "solid"}) {
    const auto field = geometry::clearance_field(map, {std::string(unknown) == "solid", 0.02});
    const auto& n = field.nodes;
    std::vector<Vec3> centers;
    std::vector<bool> is_solid;
    for (int z = 0; z < n[2]; ++z)
      for (int y = 0; y < n[1]; ++y)
        for (int x = 0; x < n[0]; ++x) {
          centers.push_back(field.origin + h * Vec3(x, y, z));
          is_solid.push_back(solid(map, centers.back(), std::string(unknown) == "solid"));
        }
    ASSERT_EQ(centers.size(), field.coarse.size());
    for (std::size_t i = 0; i < centers.size(); ++i) {
      double nearest = 1;
      for (std::size_t j = 0; j < centers.size(); ++j)
        if (is_solid[i] != is_solid[j]) nearest = std::min(nearest, (centers[i] - centers[j]).norm());
      const double expected = (is_solid[i] ? -1 : 1) * (nearest - h / 2);
      ASSERT_NEAR(field.coarse[i], expected, 1e-7) << centers[i].transpose() << " " << unknown;
    }
  }
}

// One occupied cell is a box: its distance has a closed form. A node is off by at most 0.37 cells, and what
// lies between nodes by a cell's curvature there: at most h / 4 more at a distance of 2 cells and beyond,
// where the gradient turns by 1/2 within a cell: half of that either way in
// each of two directions across, sqrt(2) / 4 together: the cosine is 0.93 or more.
TEST(Clearance, OfOneCellIsNearlyTheDistanceToABox) {
  geometry::Occupancy map{std::make_shared<octomap::OcTree>(h)};
  map.tree->updateNode(octomap::point3d(h / 2, h / 2, h / 2), true);
  const auto field = geometry::clearance_field(map, {false, 0.06});
  geometry::RandomStream random(6, 0);
  for (int i = 0; i < 500; ++i) {
    const Vec3 p = Vec3::Constant(h / 2) + (0.02 + 0.03 * random.uniform()) * random.direction();
    const Vec3 off = ((p - Vec3::Constant(h / 2)).cwiseAbs() - Vec3::Constant(h / 2)).cwiseMax(0);
    Vec3 gradient;
    const double value = field.value(p, gradient);
    EXPECT_GT(value, off.norm() - 0.01 * h);
    EXPECT_LT(value, off.norm() + 0.37 * h + h / 4);
    EXPECT_GT(gradient.normalized().dot((p - Vec3::Constant(h / 2)).normalized()), 0.93);
    EXPECT_NEAR(gradient.norm(), 1, 0.25);
  }
}

// In front of a wall the field is linear, so interpolation is exact.
TEST(Clearance, OfAWallIsTheDistanceToIt) {
  geometry::Occupancy map{std::make_shared<octomap::OcTree>(h)};
  for (int y = 0; y < 20; ++y)
    for (int z = 0; z < 20; ++z)
      map.tree->updateNode(octomap::point3d(h / 2, (y + 0.5F) * h, (z + 0.5F) * h), true);
  const auto field = geometry::clearance_field(map, {});
  for (double x : {0.011, 0.0163, 0.03, 0.0487}) {
    Vec3 gradient;
    EXPECT_NEAR(field.value({x, 0.1, 0.1}, gradient), x - h, 1e-7);
    EXPECT_LT((gradient - Vec3::UnitX()).norm(), 1e-5);
  }
}

TEST(Clearance, ReadsBackAndRefusesAnEmptyMap) {
  const auto field = geometry::clearance_field(random_map(6, 0.1), {});
  const tests::ScratchFolder folder;
  save_artefact(field, folder.path());
  geometry::SignedDistanceField read;
  load_artefact(read, folder.path());
  EXPECT_EQ(read.coarse, field.coarse);
  EXPECT_EQ(read.nodes, field.nodes);
  EXPECT_EQ(read.value({0.013, 0.027, 0.031}), field.value({0.013, 0.027, 0.031}));
  EXPECT_THROW(geometry::clearance_field({std::make_shared<octomap::OcTree>(h)}, {}), pipeline::UserError);
}

/// A ball of 50 mm that a sensor saw with noise, a wall beside it and two cells that no thing has.
class ClearanceOfOthers : public testing::Test {
 protected:
  geometry::PointCloud seen(double sigma_m) const {
    geometry::PointCloud cloud;
    geometry::RandomStream random(7, 0);
    for (const Vec3& p : datasets::icosphere(0.05, 4).vertices)
      cloud.points.push_back(p * (1 + sigma_m * random.normal() / 0.05));
    for (int y = -5; y < 5; ++y)
      for (int z = -5; z < 5; ++z) cloud.points.emplace_back(0.205, h * (y + 0.5), h * (z + 0.5));
    cloud.points.emplace_back(0.005, 0.155, 0.005);
    cloud.points.emplace_back(0.015, 0.165, 0.005);
    return cloud;
  }
  const geometry::SignedDistanceField ball_ =
      geometry::build_distance_field(datasets::icosphere(0.05, 4), {24, 0.05, 2});
};

TEST_F(ClearanceOfOthers, AreWhatIsNeitherNoiseNorStray) {
  for (double sigma_m : {0.0, 0.004}) {
    const auto cloud = seen(sigma_m);
    pipeline::Run run;
    const auto field = clearance({}, run, geometry::map_of_rays(cloud, h), cloud, ball_);
    EXPECT_EQ(run.metrics().at("foreign_cells"), 100) << sigma_m;
    EXPECT_EQ(run.metrics().at("stray_cells"), 2);
    // 2562 points: the median of |noise| is told to 2 % or so; the mesh's sag adds 0.1 mm.
    EXPECT_NEAR(run.metrics().at("point_deviation_m"), sigma_m, 2e-4 + 0.05 * sigma_m);
    EXPECT_NEAR(field.value({0.1, 0, 0}), 0.1, 1e-6);  // the wall's face is at 0.2
    EXPECT_GT(field.value({0.005, 0.155, 0.005}), 0.1);
  }
}

TEST_F(ClearanceOfOthers, NoiseCountsWhereItIsNotLookedFor) {
  const auto cloud = seen(0.004);
  pipeline::Run run;
  clearance({.near_cells = 0.5, .noise_deviations = 0, .least_cells = 1}, run,
            geometry::map_of_rays(cloud, h), cloud, ball_);
  EXPECT_GT(run.metrics().at("foreign_cells"), 102);
}

TEST_F(ClearanceOfOthers, WhatNoRayPassedMayHideSomething) {
  auto cloud = seen(0);
  cloud.support = geometry::Plane{Vec3::UnitZ(), -0.06};
  const auto map = geometry::map_of_rays(cloud, h);  // without sensors no cell is free
  pipeline::Run run;
  const auto field = clearance({.unknown = "solid"}, run, map, cloud, ball_);
  EXPECT_LT(field.value({0.12, 0.12, 0.05}), 0);
  EXPECT_GT(field.value({0, 0, 0}), 0);  // inside the object
}

TEST_F(ClearanceOfOthers, NothingIsAFieldWithoutNodes) {
  geometry::PointCloud cloud;
  cloud.points = datasets::icosphere(0.05, 4).vertices;
  pipeline::Run run;
  const auto field = clearance({}, run, geometry::map_of_rays(cloud, h), cloud, ball_);
  EXPECT_TRUE(field.coarse.empty());
  const tests::ScratchFolder folder;
  save_artefact(field, folder.path());
  geometry::SignedDistanceField read;
  load_artefact(read, folder.path());
  EXPECT_TRUE(read.coarse.empty());
}

}  // namespace
}  // namespace geocage::stages
