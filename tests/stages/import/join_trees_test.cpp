#include "stages/import/join_trees.h"

#include <gtest/gtest.h>

namespace geocage::stages {
namespace {

using geometry::Vec3;

/// Two upright squares that face a sensor at the origin, with a gap of 1 cm; one is smaller. The table lies
/// under them.
geometry::PointCloud two_squares() {
  geometry::PointCloud cloud;
  cloud.sensor_origins = {Vec3::Zero()};
  for (const double side : {-1.0, 1.0})
    for (int u = 0; u < (side < 0 ? 30 : 40); ++u)
      for (int v = 0; v < 40; ++v)
        cloud.points.emplace_back(0.8, side * (0.005 + 0.0015 * u), -0.1 + 0.0015 * v);
  return cloud;
}

struct Squares {
  geometry::PointCloud cloud = two_squares();
  Sight sight = sight_of(cloud);
  std::vector<int> all = [this] {
    std::vector<int> list(cloud.size());
    for (std::size_t i = 0; i < list.size(); ++i) list[i] = static_cast<int>(i);
    return list;
  }();
  PartGraph graph{cloud, sight, all, {Vec3::UnitZ(), -0.11}, {0.015, 15, 600, 0.25}};
};

// Evidence gives values in an order; trees ask by number. What they were trained on must be what they get.
TEST(JoinTrees, AskTheCluesThatTheyWereTrainedOn) {
  const Squares squares;
  const auto pairs = squares.graph.pairs();
  ASSERT_FALSE(pairs.empty());
  const auto names = trained_clues();
  const auto evidence = squares.graph.evidence(pairs.front());
  ASSERT_EQ(evidence.size(), names.size());
  for (std::size_t k = 0; k < names.size(); ++k) EXPECT_EQ(evidence[k].name, names[k]) << k;
}

// What is known of the squares in closed form: rows 1.5 mm apart, so 10 mm from side to side.
TEST(JoinTrees, EvidenceOfTwoSquares) {
  const Squares squares;
  const auto parts = squares.graph.parts();
  ASSERT_EQ(parts.size(), 2U);
  std::map<std::string_view, double> clue;
  for (const auto& [name, value] : squares.graph.evidence(squares.graph.pairs().front())) clue[name] = value;
  EXPECT_NEAR(clue["gap_m"], 0.01, 1e-6);
  EXPECT_NEAR(clue["coplanar_m"], 0, 1e-6);
  EXPECT_NEAR(clue["tops_m"], 0, 1e-9);
  EXPECT_NEAR(clue["wide_b_m"], 0.06, 1e-3);   // 40 x 40 of 1.5 mm
  EXPECT_NEAR(clue["wide_a_m"], 0.052, 1e-3);  // 30 x 40
  EXPECT_NEAR(clue["apart_m"], 0.01 + 0.0015 * (29 + 39) / 2, 1e-6);
  EXPECT_EQ(clue["a_in_b"], 0);
}

TEST(JoinTrees, JoinsKeepAllPoints) {
  Squares squares;
  squares.graph.join(squares.graph.pairs().front());
  const auto parts = squares.graph.parts();
  ASSERT_EQ(parts.size(), 1U);
  EXPECT_EQ(parts.begin()->second, squares.all);
  EXPECT_TRUE(squares.graph.pairs().empty());
}

}  // namespace
}  // namespace geocage::stages
