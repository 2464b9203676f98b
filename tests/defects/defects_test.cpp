#include <cstdlib>
#include <filesystem>

#include <gtest/gtest.h>

#include "datasets/shapes.h"
#include "geometry/mesh_files.h"
#include "pipeline/worker.h"
#include "tests/defects/solid_oracle.h"
#include "tests/defects/trial.h"

// A small part of the study of defects (defect_study.cpp): coarse wraps, so that it takes seconds.
namespace geocage::tests {
namespace {

using geometry::TriangleMesh;

void expect_typed_outcomes(const TriangleMesh& mesh, std::uint64_t seed) {
  ASSERT_EQ(objection_of_cgal(mesh), "");
  for (const Mutator& mutator : mutators()) {
    const Trial trial = try_defect(mutator, mesh, seed, {.wrap_alpha = 0.08});
    EXPECT_TRUE(trial.good) << trial.mutator << ": " << trial.outcome << ": " << trial.reason;
  }
}

TEST(Defects, OnATorus) {
  expect_typed_outcomes(datasets::torus(0.06, 0.02, 24, 12), 1);
}
TEST(Defects, OnACup) {
  expect_typed_outcomes(datasets::cup(0.04, 0.1, 0.008, 24), 2);
}
TEST(Defects, OnABall) {
  expect_typed_outcomes(datasets::icosphere(0.06, 3), 3);
}

TEST(Defects, MutatorsBreakWhatTheySay) {
  const auto torus = datasets::torus(0.06, 0.02, 24, 12);
  EXPECT_GE(mutators().size(), 20u);
  for (const Mutator& mutator : mutators()) {
    auto broken = torus;
    mutator.apply(broken, 5);
    const std::string name = mutator.name;
    if (name != "slivers" && name != "millimetres" && name != "huge") {  // a solid still, if an odd one
      EXPECT_NE(geometry::flaw_of_solid(broken), "") << name;
    }
    auto again = torus;
    mutator.apply(again, 5);
    EXPECT_EQ(again.triangles, broken.triangles) << name;
  }
}

TEST(Defects, OnForeignMeshes) {
  const char* folder = std::getenv("GEOCAGE_TEST_OBJECTS");
  if (!folder) GTEST_SKIP() << "GEOCAGE_TEST_OBJECTS names no folder";
  int seen = 0;
  for (const char* name : {"scissors.stl", "elephant.off"}) {
    const auto file = std::filesystem::path(folder) / name;
    if (!exists(file)) continue;
    auto mesh = pipeline::contained<TriangleMesh>({30, 4}, name, [&] { return geometry::read_mesh(file); });
    const double scale = 0.2 / check_mesh(mesh).diagonal_m();
    for (auto& p : mesh.vertices) p *= scale;
    for (const char* mutator_name : {"small holes", "double vertices", "fins", "spikes"})
      for (const Mutator& mutator : mutators()) {
        if (mutator_name != std::string(mutator.name)) continue;
        const Trial trial = try_defect(mutator, mesh, 1, {.wrap_alpha = 0.04});
        EXPECT_TRUE(trial.good) << name << ", " << trial.mutator << ": " << trial.reason;
        EXPECT_NE(trial.outcome, "rejected") << name << ", " << trial.mutator << ": " << trial.reason;
      }
    ++seen;
  }
  if (seen == 0) GTEST_SKIP() << "the folder holds none of these meshes";
}

}  // namespace
}  // namespace geocage::tests
