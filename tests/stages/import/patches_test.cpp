#include "stages/import/patches.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "stages/import/sight.h"

namespace geocage::stages {
namespace {

using geometry::Vec3;

constexpr double noise_m = 0.0005;

/// A sheet z(y) across x, 12 x 6 cm about the optical axis at 0.8 m, a point each 1.5 mm; the sensor is at 0.
template <class Depth>
std::vector<Vec3> sheet(const Depth& depth_m) {
  std::mt19937_64 random(1);
  std::normal_distribution<> noise(0, noise_m);
  std::vector<Vec3> points;
  for (int u = -40; u <= 40; ++u)
    for (int v = -20; v <= 20; ++v) {
      const double x = 0.0015 * u, y = 0.0015 * v;
      points.emplace_back(x, y, 0.8 + depth_m(y) + noise(random));
    }
  return points;
}

/// The median angle of borders across y = 0, weighted by nothing.
double crease_across(const std::vector<Vec3>& points) {
  const auto near = near_points(points, 0.01);
  const auto patches = patches_of(points, near, 0.02);
  std::vector<Vec3> middle(static_cast<std::size_t>(patches.count), Vec3::Zero());
  std::vector<int> size(static_cast<std::size_t>(patches.count), 0);
  for (std::size_t i = 0; i < points.size(); ++i) {
    middle[patches.of_point[i]] += points[i];
    ++size[patches.of_point[i]];
  }
  std::vector<double> angles;
  for (const auto& border : patches.borders) {
    const double a = middle[border.a].y() / size[border.a], b = middle[border.b].y() / size[border.b];
    if (a * b < 0 && std::min(std::abs(a), std::abs(b)) > 0.004) angles.push_back(border.hollow_rad);
  }
  if (angles.empty()) return std::nan("");
  std::nth_element(angles.begin(), angles.begin() + static_cast<long>(angles.size() / 2), angles.end());
  return angles[angles.size() / 2];
}

// Two planes at 30 degrees to the image: a crease of 60 degrees, hollow where it points away from the sensor.
// Strips of 1 cm with 50 points and 0.5 mm of noise fix a slope to 0.5 / (2.9 sqrt 50) = 1.4 degrees; twice
// that and the patches' ragged borders: 10 degrees.
TEST(Patches, CreasesHaveTheirAngleAndSign) {
  const double slope = std::tan(M_PI / 6);
  EXPECT_NEAR(crease_across(sheet([&](double y) { return -slope * std::abs(y); })), M_PI / 3, 0.18);
  EXPECT_NEAR(crease_across(sheet([&](double y) { return slope * std::abs(y); })), -M_PI / 3, 0.18);
}

// The inside of a tube of 40 mm turns by 29 degrees from patch to patch; no crease. The planes' angles are
// those of chords, which differ from twice each other in the third order: 10 degrees are ample.
TEST(Patches, ABendIsNoCrease) {
  const double r = 0.04;
  const auto tube = [&](double y) { return std::sqrt(r * r - y * y) - r; };
  EXPECT_NEAR(crease_across(sheet(tube)), 0, 0.18);
  EXPECT_NEAR(crease_across(sheet([&](double y) { return -tube(y); })), 0, 0.18);
}

TEST(Sight, KnowsWhatIsEmpty) {
  const auto wall = sheet([](double) { return 0.0; });
  const Sight sight(wall);
  EXPECT_TRUE(sight.empty({0, 0, 0.7}, 0.008));
  EXPECT_FALSE(sight.empty({0, 0, 0.8}, 0.008));    // on it
  EXPECT_FALSE(sight.empty({0, 0, 0.9}, 0.008));    // behind it
  EXPECT_FALSE(sight.empty({0.3, 0, 0.7}, 0.008));  // where nothing was seen
  EXPECT_FALSE(sight.empty({0, 0, -0.7}, 0.008));   // behind the sensor
  EXPECT_EQ(sight.emptiness_between(wall, wall, 0.008), 0);
}

// Of two points at heights a, b across a half tube of r = 30 mm, the middle lies before it by h((a + b) / 2)
// - (h(a) + h(b)) / 2, h(y) = sqrt(r^2 - y^2); by more than 8 mm for 14.0 % of evenly drawn a, b (2e5 draws).
// 400 pairs scatter by 1.7 %, and neighbouring cells, which count too, take some off. Of the outside, never.
TEST(Sight, AHollowIsEmptyAndARidgeIsNot) {
  const double r = 0.03;
  const auto half = [&](double y) { return std::sqrt(std::max(0.0, r * r - y * y)); };
  const auto hollow = sheet(half), ridge = sheet([&](double y) { return -half(y); });
  EXPECT_NEAR(Sight(hollow).emptiness_between(hollow, hollow, 0.008), 0.14, 0.04);
  EXPECT_EQ(Sight(ridge).emptiness_between(ridge, ridge, 0.008), 0);
}

TEST(Sight, CountsWhatIsSeenBesideSomethingNearer) {
  const auto wall = sheet([](double) { return 0.0; });
  std::vector<Vec3> bar;  // 3 mm wide, 5 cm before the wall
  for (int u = -30; u <= 30; ++u)
    for (int v = -1; v <= 1; ++v) bar.emplace_back(0.0015 * u, 0.0015 * v, 0.75);
  auto all = wall;
  all.insert(all.end(), bar.begin(), bar.end());
  const Sight sight(all);
  // Wall points within two cells (5 mrad, 4 mm) of the bar, which covers 3 mm / 0.75 x 0.8: 11 mm of 60.
  const double share = static_cast<double>(sight.hidden_behind(wall, sight.front_of(bar), 0.004)) /
                       static_cast<double>(wall.size());
  EXPECT_GT(share, 0.05);
  EXPECT_LT(share, 0.3);
  EXPECT_EQ(sight.hidden_behind(bar, sight.front_of(wall), 0.004), 0);
}

}  // namespace
}  // namespace geocage::stages
