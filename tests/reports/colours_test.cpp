#include "reports/colours.h"

#include <cmath>

#include <gtest/gtest.h>

namespace geocage::reports {
namespace {

// Relative luminance of linear sRGB (IEC 61966-2-1).
double luminance(const Colour& c) {
  return 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2];
}

TEST(Colours, OklchOfNoChromaIsGreyOfCubedLightness) {
  for (double lightness : {0.1, 0.5, 0.9}) {
    const Colour grey = oklch(lightness, 0, 123);
    EXPECT_NEAR((grey - Colour::Constant(std::pow(lightness, 3))).norm(), 0,
                1e-6);  // the matrices have 10 digits
  }
}

TEST(Colours, SequentialMapGrowsLighterAllTheWay) {
  const Scale scale{Scale::Map::sequential, 2, 5};
  for (int i = 0; i < 100; ++i)
    EXPECT_LT(luminance(scale.at(2 + 0.03 * i)), luminance(scale.at(2 + 0.03 * (i + 1)))) << i;
}

TEST(Colours, DivergingMapIsPaleInTheMiddleAndSaysTheSideByItsHue) {
  const Scale scale{Scale::Map::diverging, -1, 1};
  const Colour low = scale.at(-1), middle = scale.at(0), high = scale.at(1);
  EXPECT_GT(low[2], low[0]);
  EXPECT_GT(high[0], high[2]);
  EXPECT_GT(luminance(middle), luminance(low));
  EXPECT_GT(luminance(middle), luminance(high));
}

TEST(Colours, EveryColourExistsAndNanIsGrey) {
  for (const auto map : {Scale::Map::sequential, Scale::Map::diverging})
    for (int i = -10; i <= 110; ++i) {
      const Colour c = Scale{map, 0, 1}.at(i / 100.0);
      EXPECT_GE(c.minCoeff(), 0);
      EXPECT_LE(c.maxCoeff(), 1);
    }
  const Colour none = Scale{}.at(std::nan(""));
  EXPECT_EQ(none[0], none[1]);
  EXPECT_EQ(none[1], none[2]);
}

TEST(Colours, ScalesLeaveOutliersAndNanOut) {
  std::vector<double> values = {std::nan("")};
  for (int i = 0; i <= 1000; ++i) values.push_back(i);
  values.back() = 1e9;
  const Scale plain = sequential_scale(values, 0.02);
  EXPECT_EQ(plain.low, 10);
  EXPECT_EQ(plain.high, 990);
  const Scale even = diverging_scale({-3, 1, 2, std::nan("")}, 0, 0);
  EXPECT_EQ(even.low, -3);
  EXPECT_EQ(even.high, 3);
  EXPECT_EQ(sequential_scale({std::nan("")}).high, 1);
}

TEST(Colours, CssIsWhatScreensTake) {
  EXPECT_EQ(css(Colour::Zero()), "#000000");
  EXPECT_EQ(css(Colour::Ones()), "#ffffff");
  EXPECT_EQ(css({0.2158605, 0, 1}), "#8000ff");  // sRGB 128 is linear 0.21586
}

}  // namespace
}  // namespace geocage::reports
