#include "stages/import/parts.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "stages/import/join_trees.h"
#include "stages/import/part_graph.h"

namespace geocage::stages {

namespace {

using Pair = PartGraph::Pair;

bool has(const Pair& pair, int name) {
  return pair.first == name || pair.second == name;
}

/// How likely each pair of parts is one thing; of pairs that a join left alone it is remembered.
class Odds {
 public:
  Odds(PartGraph& graph, const Joining& joining) : graph_(graph), joining_(joining) {}

  double of(const Pair& pair) {
    const auto [known, fresh] = known_.try_emplace(pair, 0);
    if (fresh) known->second = joining_.probability(graph_, pair);
    return known->second;
  }
  /// The likeliest pair; of those with this part, where one is named.
  std::optional<Pair> likeliest(int with = -1) {
    std::optional<Pair> best;
    for (const Pair& pair : graph_.pairs())
      if ((with < 0 || has(pair, with)) && (!best || of(pair) > of(*best))) best = pair;
    return best;
  }
  void join(const Pair& pair) {
    graph_.join(pair);
    std::erase_if(known_,
                  [&](const auto& k) { return has(k.first, pair.first) || has(k.first, pair.second); });
    if (joining_.after) joining_.after(pair.first);
  }

 private:
  PartGraph& graph_;
  const Joining& joining_;
  std::map<Pair, double> known_;
};

/// The smallest part of fewer points.
std::optional<int> fragment(const PartGraph& graph, int points) {
  std::optional<int> least;
  for (const auto& [name, size] : graph.sizes())
    if (size < points) {
      least = name;
      points = size;
    }
  return least;
}

}  // namespace

int join_likely(PartGraph& graph, const PartRule& rule, const Joining& joining) {
  constexpr double sure = 3;  // odds, against those of the limit
  Odds odds(graph, joining);
  const auto in_doubt = [&](double p) {
    const double ratio = p / (1 - p) * (1 - rule.one_thing) / rule.one_thing;
    return ratio < sure && ratio > 1 / sure;
  };
  int doubtful = 0;
  for (;;) {  // what has taken a fragment up may be one with another, too
    auto next = odds.likeliest();
    if (next && odds.of(*next) >= rule.one_thing) {
      doubtful += in_doubt(odds.of(*next));
    } else {
      const auto name = fragment(graph, rule.points);
      next = name ? odds.likeliest(*name) : std::nullopt;
    }
    if (!next) break;
    odds.join(*next);
  }
  for (const Pair& pair : graph.pairs()) doubtful += in_doubt(odds.of(pair));
  return doubtful;
}

Parts parts_by_shape(const geometry::PointCloud& cloud, const Sight& sight, const std::vector<int>& cluster,
                     const geometry::Plane& table, const PartRule& rule) {
  PartGraph graph(cloud, sight, cluster, table, rule);
  Parts parts;
  parts.doubtful = join_likely(graph, rule, {[](const PartGraph& of, const Pair& pair) {
                                 return probability_of_one(of.evidence(pair));
                               }});
  for (auto& [name, points] : graph.parts()) parts.points.push_back(std::move(points));
  return parts;
}

}  // namespace geocage::stages
