#pragma once
#include <functional>
#include <vector>

#include "geometry/cloud.h"
#include "stages/import/sight.h"

namespace geocage::stages {

constexpr double most_gap_m = 0.03;  ///< parts that are farther apart are not asked whether they are one

struct PartRule {
  double patch_m;        ///< size of the patches that are compared
  double concavity_deg;  ///< neighbours that meet at a hollower angle belong to different pieces
  int points;        ///< a part with fewer points belongs to the neighbour that it most likely is one with
  double one_thing;  ///< pieces are joined that are one thing with at least this probability
};

class PartGraph;
struct Joining {
  /// How likely two parts are one thing.
  std::function<double(const PartGraph&, const std::pair<int, int>&)> probability;
  std::function<void(int)> after = {};  ///< told which part took another up
};
/// Joins the likeliest pair again and again while it is `rule.one_thing` likely, then the smallest part of
/// fewer than `rule.points` points to its likeliest neighbour, and so on; how many pairs were joined or left
/// though the odds were no better than 3 to 1.
int join_likely(PartGraph& graph, const PartRule& rule, const Joining& joining);

/// Objects of one cluster, and how sure that is.
struct Parts {
  std::vector<std::vector<int>> points;  ///< of each object; indices ascending
  int doubtful = 0;  ///< pairs joined or kept apart though the odds were no better than 3 to 1
};

/// Objects that touch: the points of one cluster fall into pieces that end in hollow creases, and pieces are
/// joined, the likeliest pair first, that are probably one thing (part_graph.h, join_trees.h). Precondition:
/// one sensor, whose place is known: it tells which way a patch faces, and which places are empty.
Parts parts_by_shape(const geometry::PointCloud& cloud, const Sight& sight, const std::vector<int>& cluster,
                     const geometry::Plane& table, const PartRule& rule);

}  // namespace geocage::stages
