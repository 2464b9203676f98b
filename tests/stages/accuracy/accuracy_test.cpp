#include "stages/accuracy/accuracy.h"

#include <gtest/gtest.h>

#include "datasets/shapes.h"
#include "tests/pipeline/scratch_folder.h"

namespace geocage::stages {
namespace {

// Two spheres with one centre: every distance is the difference of the radii. The inscribed polyhedra of 5120
// triangles lie up to r (1 - cos(edge / 2 / r)) < 0.1 % of r inside.
TEST(Accuracy, SpheresInsideEachOther) {
  pipeline::Run run;
  const auto found = accuracy({}, run, datasets::icosphere(0.052, 4), datasets::icosphere(0.05, 4));
  for (double d : {found.off_max_m, found.off_mean_m, found.missing_max_m, found.missing_mean_m})
    EXPECT_NEAR(d, 0.002, 6e-5);
  EXPECT_EQ(found.genus, 0);
  EXPECT_TRUE(found.solid);
  EXPECT_EQ(run.metrics().at("genus_kept"), 1);
}

// A box with a wall missing: nothing is made up, and the middle of the wall is as far as half its side.
TEST(Accuracy, WhatIsMissingIsNotWhatIsMadeUp) {
  auto open = datasets::box({0.1, 0.1, 0.1}, 10);
  std::erase_if(open.triangles, [&](const auto& t) {
    return open.vertices[t[0]].z() > 0.0499 && open.vertices[t[1]].z() > 0.0499 &&
           open.vertices[t[2]].z() > 0.0499;
  });
  pipeline::Run run;
  const auto found = accuracy({}, run, open, datasets::box({0.1, 0.1, 0.1}, 10));
  EXPECT_LT(found.off_max_m, 1e-12);
  EXPECT_GE(found.missing_max_m + found.sampling_m, 0.05);
  EXPECT_LT(found.missing_max_m, 0.05 + 1e-12);
  EXPECT_FALSE(found.solid);
}

TEST(Accuracy, PartsMeansByWhatWasObserved) {
  auto surface = datasets::icosphere(0.05, 3);
  for (auto& p : surface.vertices) {
    surface.observed.push_back(p.z() > 0 ? 1 : 0.2);
    if (p.z() <= 0) p *= 1.1;
  }
  pipeline::Run run;
  const auto found = accuracy({}, run, surface, datasets::icosphere(0.05, 3));
  EXPECT_LT(found.observed_mean_m, 1e-9);
  EXPECT_NEAR(found.guessed_mean_m, 0.005, 1e-4);
  EXPECT_NEAR(found.observed_share, 0.5, 0.05);
}

TEST(Accuracy, ArtefactReadsBack) {
  const tests::ScratchFolder folder;
  pipeline::Run run;
  const auto found = accuracy({}, run, datasets::torus(0.04, 0.01, 20, 10), datasets::cube());
  save_artefact(found, folder.path());
  geometry::Accuracy read;
  load_artefact(read, folder.path());
  EXPECT_EQ(read.off_mean_m, found.off_mean_m);
  EXPECT_EQ(read.missing_max_m, found.missing_max_m);
  EXPECT_EQ(read.genus, 1);
  EXPECT_TRUE(read.solid);
}

}  // namespace
}  // namespace geocage::stages
