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
  /// The likeliest pair of the small part that most likely belongs to any larger one, if that is likely
  /// enough: larger ones are different things, so that their probabilities add up.
  std::optional<Pair> claimed() {
    constexpr int small_points = 1500;
    constexpr double enough = 0.3;
    const auto sizes = graph_.sizes();
    std::map<int, std::pair<double, Pair>> claims;  // of the smaller part: all, and the likeliest
    for (const Pair& pair : graph_.pairs()) {
      const int smaller = sizes.at(pair.first) < sizes.at(pair.second) ? pair.first : pair.second;
      if (sizes.at(smaller) > small_points) continue;
      auto& [sum, best] = claims.try_emplace(smaller, 0.0, pair).first->second;
      sum += of(pair);
      if (of(pair) > of(best)) best = pair;
    }
    const auto most = std::max_element(claims.begin(), claims.end(), [](const auto& a, const auto& b) {
      return a.second.first < b.second.first;
    });
    if (most == claims.end() || most->second.first < enough) return std::nullopt;
    return most->second.second;
  }
  /// The smallest part of fewer than `points` points and its likeliest neighbour, unless it has enough for an
  /// object and that isn't likely at all.
  std::optional<Pair> fragment(int points, int object_points) {
    constexpr double least = 0.02;
    std::vector<std::pair<int, int>> small;
    for (const auto& [name, size] : graph_.sizes())
      if (size < points) small.emplace_back(size, name);
    std::sort(small.begin(), small.end());
    for (const auto& [size, name] : small)
      if (const auto next = likeliest(name); next && (size < object_points || of(*next) >= least))
        return next;
    return std::nullopt;
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
      next = odds.claimed();
      if (next &&
          std::min(graph.sizes().at(next->first), graph.sizes().at(next->second)) >= rule.object_points)
        ++doubtful;
      if (!next) next = odds.fragment(rule.points, rule.object_points);
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
