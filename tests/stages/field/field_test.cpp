#include "stages/field/field.h"

#include <gtest/gtest.h>

#include "datasets/shapes.h"
#include "pipeline/error.h"

namespace geocage::stages {
namespace {

TEST(FieldStage, TellsItsCells) {
  pipeline::Run run;
  const auto value = field({.cells = 20, .pad_m = 0.01, .refine = 2}, run, datasets::box({0.08, 0.02, 0.02}));
  EXPECT_NEAR(run.metrics().at("cell_m"), 0.1 / 20, 1e-12);
  EXPECT_NEAR(value.value({0, 0, 0.015}), 0.005, 1e-6);  // flat faces: trilinear is exact
}

TEST(FieldStage, OpenMeshIsRefusedInWords) {
  pipeline::Run run;
  try {
    field({}, run, datasets::flat_grid(0.1, 4));
    FAIL();
  } catch (const pipeline::UserError& error) {
    EXPECT_EQ(error.fault(), pipeline::Fault::geometry);
    EXPECT_NE(error.sentence().find("not closed"), std::string::npos);
  }
}

}  // namespace
}  // namespace geocage::stages
