#include "stages/import/table.h"

#include <algorithm>
#include <map>
#include <numeric>
#include <random>

#include <gtest/gtest.h>

namespace geocage::stages {
namespace {

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

}  // namespace
}  // namespace geocage::stages
