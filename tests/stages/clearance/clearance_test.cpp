#include "stages/clearance/clearance.h"

#include <cmath>

#include <gtest/gtest.h>
#include <octomap/octomap.h>

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
    pipeline::Run run;
    const auto field = clearance({.unknown = unknown, .pad_m = 0.02}, run, map);
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
  pipeline::Run run;
  const auto field = clearance({.pad_m = 0.06}, run, map);
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
  pipeline::Run run;
  const auto field = clearance({}, run, map);
  for (double x : {0.011, 0.0163, 0.03, 0.0487}) {
    Vec3 gradient;
    EXPECT_NEAR(field.value({x, 0.1, 0.1}, gradient), x - h, 1e-7);
    EXPECT_LT((gradient - Vec3::UnitX()).norm(), 1e-5);
  }
}

TEST(Clearance, ReadsBackAndRefusesAnEmptyMap) {
  pipeline::Run run;
  const auto field = clearance({}, run, random_map(6, 0.1));
  const tests::ScratchFolder folder;
  save_artefact(field, folder.path());
  geometry::SignedDistanceField read;
  load_artefact(read, folder.path());
  EXPECT_EQ(read.coarse, field.coarse);
  EXPECT_EQ(read.nodes, field.nodes);
  EXPECT_EQ(read.value({0.013, 0.027, 0.031}), field.value({0.013, 0.027, 0.031}));
  EXPECT_THROW(clearance({}, run, {std::make_shared<octomap::OcTree>(h)}), pipeline::UserError);
}

}  // namespace
}  // namespace geocage::stages
