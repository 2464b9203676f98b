#include "stages/import/multicut.h"

#include <algorithm>
#include <functional>
#include <random>
#include <set>

#include <gtest/gtest.h>

namespace geocage::stages {
namespace {

using Partition = std::vector<int>;

std::vector<Bond> random_bonds(int nodes, std::mt19937_64& random) {
  std::vector<Bond> bonds;
  for (int a = 0; a < nodes; ++a)
    for (int b = a + 1; b < nodes; ++b)
      if (random() % 3 != 0) bonds.push_back({a, b, static_cast<double>(random() % 2001) / 1000 - 1});
  return bonds;
}

/// The least cut over all partitions (restricted growth strings).
double least_cut(int nodes, const std::vector<Bond>& bonds) {
  Partition part(static_cast<std::size_t>(nodes), 0);
  double least = 0;
  const std::function<void(int, int)> grow = [&](int node, int parts) {
    if (node == nodes) {
      least = std::min(least, cut_weight(part, bonds));
      return;
    }
    for (int p = 0; p <= parts; ++p) {
      part[node] = p;
      grow(node + 1, std::max(parts, p + 1));
    }
  };
  grow(0, 0);
  return least;
}

// Two lids that look like one plane hold two cans together, but less than the groove between them parts them.
TEST(Multicut, AWeakBondDoesNotJoinWhatAStrongOneParts) {
  const std::vector<Bond> cans = {{0, 1, 0.06}, {2, 3, 0.06}, {0, 2, 0.02}, {1, 3, -0.1}};
  const auto part = multicut(4, cans);
  EXPECT_EQ(part[0], part[1]);
  EXPECT_EQ(part[2], part[3]);
  EXPECT_NE(part[0], part[2]);
}

TEST(Multicut, ADifferentNameForEachPartFromZero) {
  const auto part = multicut(5, {{0, 1, -1}, {1, 2, 1}, {3, 4, -2}});
  const std::set<int> names(part.begin(), part.end());
  EXPECT_EQ(names, (std::set<int>{0, 1, 2, 3}));
  EXPECT_EQ(part[1], part[2]);
}

// Against all partitions of small graphs: never better, equal for most, and where it is not, no join of two
// parts and no move of one node helps.
TEST(Multicut, NoJoinAndNoMoveHelps) {
  std::mt19937_64 random(1);
  int best = 0, graphs = 0;
  for (; graphs < 200; ++graphs) {
    const int nodes = 4 + static_cast<int>(random() % 4);
    const auto bonds = random_bonds(nodes, random);
    const auto part = multicut(nodes, bonds);
    const double found = cut_weight(part, bonds), least = least_cut(nodes, bonds);
    EXPECT_GE(found, least - 1e-9);
    best += found < least + 1e-9;
    for (int p = 0; p < nodes; ++p)
      for (int q = 0; q < p; ++q) {
        auto joined = part;
        std::replace(joined.begin(), joined.end(), p, q);
        EXPECT_GE(cut_weight(joined, bonds), found - 1e-9);
      }
    for (int v = 0; v < nodes; ++v)
      for (int p = 0; p <= nodes; ++p) {
        auto moved = part;
        moved[v] = p;
        EXPECT_GE(cut_weight(moved, bonds), found - 1e-9);
      }
  }
  EXPECT_GT(best, graphs / 2);
}

}  // namespace
}  // namespace geocage::stages
