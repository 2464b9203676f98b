#include "stages/import/table.h"

#include <algorithm>
#include <map>
#include <numeric>
#include <random>

#include <gtest/gtest.h>

#include "stages/import/outline.h"

namespace geocage::stages {
namespace {

using geometry::Vec3;

/// Every point to every other: the definition.
std::vector<std::vector<int>> by_all_pairs(const geometry::PointCloud& cloud, double gap_m,
                                           std::size_t least) {
  std::vector<int> name(cloud.size());
  std::iota(name.begin(), name.end(), 0);
  for (std::size_t i = 0; i < cloud.size(); ++i)
    for (std::size_t j = 0; j < i; ++j)
      if ((cloud.points[i] - cloud.points[j]).norm() <= gap_m)
        std::replace(name.begin(), name.end(), int{name[i]}, int{name[j]});
  std::map<int, std::vector<int>> members;
  for (std::size_t i = 0; i < cloud.size(); ++i) members[name[i]].push_back(static_cast<int>(i));
  std::vector<std::vector<int>> clusters;
  for (const auto& [first, list] : members)
    if (list.size() >= least) clusters.push_back(list);
  std::sort(clusters.begin(), clusters.end(),
            [](const auto& a, const auto& b) { return a.size() != b.size() ? a.size() > b.size() : a < b; });
  return clusters;
}

// 600 points in a cube of side 1: at a gap of 0.05 each has 0.3 neighbours and clusters are crumbs, at 0.08
// 1.3, and at 0.11 3.3, where most hang together: all sizes of clusters occur.
TEST(Clusters, AreThoseOfAllPairs) {
  std::mt19937 engine(3);
  geometry::PointCloud cloud;
  const auto coordinate = [&] { return static_cast<double>(engine()) * 0x1p-32 - 0.5; };
  for (int i = 0; i < 600; ++i) cloud.points.emplace_back(coordinate(), coordinate(), coordinate());
  std::vector<int> all(cloud.size());
  std::iota(all.begin(), all.end(), 0);
  for (const double gap_m : {0.05, 0.08, 0.11})
    for (const int least : {1, 3}) {
      const auto right = by_all_pairs(cloud, gap_m, static_cast<std::size_t>(least));
      EXPECT_GT(right.size(), 1U);
      EXPECT_EQ(clusters_of(cloud, all, gap_m, least), right) << gap_m;
    }
  EXPECT_TRUE(clusters_of(cloud, {}, 0.1, 1).empty());
}

// Two squares of 5 x 5 points in one plane, 4 apart, with each corner there twice: all on common spheres.
TEST(Clusters, OfGridsAndTwins) {
  geometry::PointCloud cloud;
  for (int square = 0; square < 2; ++square)
    for (int twice = 0; twice < 2; ++twice)
      for (int x = 0; x < 5; x += twice == 0 ? 1 : 4)
        for (int y = 0; y < 5; y += twice == 0 ? 1 : 4) cloud.points.emplace_back(x + 8 * square, y, 0);
  std::vector<int> all(cloud.size());
  std::iota(all.begin(), all.end(), 0);
  for (const double gap_m : {0.5, 1.0, 3.9, 4.0})
    EXPECT_EQ(clusters_of(cloud, all, gap_m, 1), by_all_pairs(cloud, gap_m, 1)) << gap_m;
  EXPECT_EQ(clusters_of(cloud, all, 1, 1).size(), 2U);
}

/// Points on a rectangle from a corner along two sides, about so far apart, up to 0.2 mm off.
void put_rectangle(geometry::PointCloud& cloud, const Vec3& corner, const Vec3& a, const Vec3& b,
                   double apart_m = 0.01) {
  const int along = static_cast<int>(a.norm() / apart_m), across = static_cast<int>(b.norm() / apart_m);
  for (int i = 0; i <= along; ++i)
    for (int j = 0; j <= across; ++j)
      cloud.points.push_back(corner + a * i / along + b * j / across +
                             2e-4 *
                                 Vec3(std::sin(37 * i + j), std::sin(91 * j + i), std::sin(53 * i + 7 * j)));
}

/// A table of 0.8 x 0.6 m with its top at z = 0, and a box of 10 cm on it, as a sensor at -x sees them.
geometry::PointCloud a_box_on_a_table() {
  geometry::PointCloud cloud;
  cloud.sensor_origins = {{-0.7, 0, 0.5}};
  put_rectangle(cloud, {-0.05, -0.05, 0.002}, {0, 0.1, 0}, {0, 0, 0.098}, 0.005);
  put_rectangle(cloud, {-0.045, -0.05, 0.1}, {0.095, 0, 0}, {0, 0.1, 0}, 0.005);
  put_rectangle(cloud, {-0.4, -0.3, 0}, {0.8, 0, 0}, {0, 0.6, 0});
  return cloud;
}
constexpr TableRule rule{0.008, 0.01, 0.5, 300, 1};

/// Of the box, which comes first: those higher than a centimetre.
std::vector<int> points_of_the_box(const geometry::PointCloud& upright, std::size_t count) {
  std::vector<int> box;
  for (std::size_t i = 0; i < count; ++i)
    if (upright.points[i].z() >= 0.01) box.push_back(static_cast<int>(i));
  return box;
}

// The floor and the wall are larger than the table, the wall touches it, another box stands on the floor.
TEST(FindTable, InARoomHoldsWhatStandsOnTheTable) {
  auto cloud = a_box_on_a_table();
  const std::size_t of_box = 21 * 20 + 20 * 21;
  const auto box = points_of_the_box(cloud, of_box);
  const std::size_t of_table = cloud.size();
  put_rectangle(cloud, {0.405, -1.5, -0.75}, {0, 3, 0}, {0, 0, 2});
  put_rectangle(cloud, {-0.4, -1.5, -0.75}, {0.8, 0, 0}, {0, 1.1, 0});
  put_rectangle(cloud, {-0.4, 0.4, -0.75}, {0.8, 0, 0}, {0, 1.1, 0});
  put_rectangle(cloud, {-0.2, 0.6, -0.745}, {0, 0.4, 0}, {0, 0, 0.3});
  put_rectangle(cloud, {-0.2, 0.6, -0.445}, {0.4, 0, 0}, {0, 0.4, 0});
  EXPECT_GT(find_plane(cloud, rule.plane_tolerance_m, rule.seed).on.size(), of_table);  // the wall
  for (const double turn_rad : {0.0, 0.9}) {
    const Eigen::Matrix3d R = Eigen::AngleAxisd(turn_rad, Vec3(1, 2, -1).normalized()).toRotationMatrix();
    auto turned = cloud;
    for (Vec3& p : turned.points) p = R * p;
    turned.sensor_origins = {R * cloud.sensor_origins.front()};
    const auto found = find_table(turned, rule);
    EXPECT_TRUE(found.in_room);
    EXPECT_GT(found.table.plane.normal.dot(R.col(2)), 1 - 1e-6);
    // Of the box alone; what shares a cell of a centimetre with the table may go: a row of 20 points, of 780.
    EXPECT_TRUE(std::includes(box.begin(), box.end(), found.standing.begin(), found.standing.end()));
    EXPECT_GE(found.standing.size() + 20, box.size());
  }
}

// Over the table's back a shelf, under which the wall is seen; behind the box a board of which the box hides
// all below 5 cm.
TEST(FindTable, AShelfDoesNotStandOnTheTableAndWhatIsHalfHiddenDoes) {
  auto cloud = a_box_on_a_table();
  const auto board = cloud.size();
  put_rectangle(cloud, {0.15, -0.04, 0.06}, {0, 0.08, 0}, {0, 0, 0.14}, 0.005);
  const auto shelf = cloud.size();
  put_rectangle(cloud, {0.25, -0.3, 0.35}, {0, 0.6, 0}, {0, 0, 0.02}, 0.005);
  put_rectangle(cloud, {0.25, -0.3, 0.37}, {0.15, 0, 0}, {0, 0.6, 0}, 0.005);
  const auto room = cloud.size();
  put_rectangle(cloud, {0.405, -0.4, 0.01}, {0, 0.8, 0}, {0, 0, 0.24}, 0.003);
  put_rectangle(cloud, {0.405, -1.5, -0.75}, {0, 3, 0}, {0, 0, 0.75});
  put_rectangle(cloud, {-0.4, -1.5, -0.75}, {0.8, 0, 0}, {0, 1.1, 0});
  const auto found = find_table(cloud, rule);
  EXPECT_TRUE(found.in_room);
  const auto standing = [&](std::size_t from, std::size_t to) {
    return std::ranges::count_if(found.standing, [&](int i) {
      return static_cast<std::size_t>(i) >= from && static_cast<std::size_t>(i) < to;
    });
  };
  EXPECT_EQ(standing(board, shelf), static_cast<std::ptrdiff_t>(shelf - board));
  EXPECT_EQ(standing(shelf, room), 0);
}

TEST(FindTable, WithoutARoomIsTheLargestPlane) {
  const auto cloud = a_box_on_a_table();
  const auto found = find_table(cloud, rule);
  const auto plane = find_plane(cloud, rule.plane_tolerance_m, rule.seed);
  EXPECT_FALSE(found.in_room);
  EXPECT_EQ(found.table.on, plane.on);
  EXPECT_EQ(found.standing, standing_on(cloud, plane, rule.above_min_m, rule.above_max_m));
  EXPECT_EQ(found.standing, points_of_the_box(cloud, 21 * 20 + 20 * 21));
}

// A square with a corner cut off; half a metre beside it, and on its border.
TEST(Outline, HoldsFeetInTheHull) {
  const geometry::Plane plane{Vec3::UnitZ(), 0.3};
  const Outline outline(
      plane, {{0, 0, 0.3}, {1, 0, 0.3}, {1, 0.5, 0.3}, {0.5, 1, 0.3}, {0, 1, 0.3}, {0.5, 0.5, 0.3}});
  EXPECT_TRUE(outline.holds({0.7, 0.7, 5}));
  EXPECT_FALSE(outline.holds({0.8, 0.8, 0.3}));
  EXPECT_TRUE(outline.holds({0.8, 0.8, 0.3}, 0.1));  // 0.1 / sqrt(2) beyond the cut
  EXPECT_FALSE(outline.holds({1.5, 0.2, 0.3}, 0.4));
  EXPECT_FALSE(Outline(plane, {}).holds({0, 0, 0}));
  EXPECT_FALSE(Outline(plane, {{0, 0, 0}, {1, 0, 0}}).holds({0.5, 0, 0}));
}

}  // namespace
}  // namespace geocage::stages
