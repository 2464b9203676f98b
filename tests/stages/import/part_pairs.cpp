// Pairs of parts of table scenes, what tells whether they are one thing, and whether they are, for
// train_joins.py:
//   build/release/table_study --set training --keep FOLDER [--objects DIR]
//   build/release/part_pairs FOLDER training PAIRS.csv
// Pairs of the parts as they come, and again when one of the two has taken another up, while joins are
// import's with odds that chance and the truth have changed (--runs, --noise, --truth): mostly right ones,
// and mistakes from which trees learn to go on. Says at last in how many scenes right joins alone make an
// object of each thing: the best that joins can do.
#include <fstream>
#include <optional>
#include <random>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <fmt/ostream.h>

#include "geometry/cloud_files.h"
#include "stages/import/import.h"
#include "stages/import/join_trees.h"
#include "stages/import/part_graph.h"
#include "stages/import/table.h"
#include "tests/stages/import/label_match.h"

namespace fs = std::filesystem;
using namespace geocage;
using stages::PartGraph;

namespace {

/// The label that most points of a part have (0 only where none has another), and their share.
struct Thing {
  int label = 0;
  double share = 0;
};
std::map<int, Thing> things_of(const PartGraph& graph, const geometry::PointCloud& cloud) {
  std::map<int, Thing> thing;
  for (const auto& [name, points] : graph.parts()) {
    std::map<int, int> votes;
    for (int i : points)
      if (cloud.label[i] != 0) ++votes[cloud.label[i]];
    thing[name] = {0, votes.empty() ? 1.0 : 0.0};
    for (const auto& [label, count] : votes)
      if (const double share = static_cast<double>(count) / static_cast<double>(points.size());
          share > thing[name].share)
        thing[name] = {label, share};
  }
  return thing;
}

/// A row for a pair, unless one of the two is two things already: that teaches nothing.
class Teller {
 public:
  Teller(std::ostream& out, std::string scene, const geometry::PointCloud& cloud)
      : out_(out), scene_(std::move(scene)), cloud_(cloud) {}

  /// Tells whether the two are one thing, where both are of one alone.
  std::optional<bool> tell(const PartGraph& graph, const PartGraph::Pair& pair,
                           const stages::Evidence& evidence) {
    constexpr double least_share = 0.75;
    if (out_.tellp() == 0) {
      fmt::print(out_, "scene,one,smaller,larger");
      for (const auto& clue : evidence) fmt::print(out_, ",{}", clue.name);
      fmt::print(out_, "\n");
    }
    if (thing_.empty()) {
      thing_ = things_of(graph, cloud_);
      size_ = graph.sizes();
    }
    const Thing &a = thing_.at(pair.first), &b = thing_.at(pair.second);
    if (std::min(a.share, b.share) < least_share) return std::nullopt;
    const auto [smaller, larger] = std::minmax(size_.at(pair.first), size_.at(pair.second));
    fmt::print(out_, "{},{},{},{}", scene_, static_cast<int>(a.label == b.label), smaller, larger);
    for (const auto& clue : evidence) fmt::print(out_, ",{:.5g}", clue.value);
    fmt::print(out_, "\n");
    return a.label == b.label;
  }
  /// Parts have changed.
  void changed() { thing_.clear(); }

 private:
  std::ostream& out_;
  const std::string scene_;
  const geometry::PointCloud& cloud_;
  std::map<int, Thing> thing_;
  std::map<int, int> size_;
};

/// Joins what belongs together.
void join_rightly(PartGraph& graph, const geometry::PointCloud& cloud) {
  for (;;) {
    const auto thing = things_of(graph, cloud);
    const auto pairs = graph.pairs();
    const auto next = std::find_if(pairs.begin(), pairs.end(), [&](const PartGraph::Pair& pair) {
      return thing.at(pair.first).label == thing.at(pair.second).label;
    });
    if (next == pairs.end()) return;
    graph.join(*next);
  }
}

/// Joins as import does, with odds that chance and the truth have multiplied: states that its mistakes lead
/// to. Each pair is told when it is asked for, first and whenever one of the two has changed.
void join_as_import(PartGraph& graph, const stages::PartRule& rule, double noise, double truth,
                    std::uint64_t seed, Teller& teller) {
  std::mt19937_64 engine(seed);
  std::normal_distribution<double> normal(0, noise);
  const auto probability = [&](const PartGraph& parts, const PartGraph::Pair& pair) {
    const auto evidence = parts.evidence(pair);
    const auto one = teller.tell(parts, pair, evidence);
    const double p = stages::probability_of_one(evidence), known = one ? (*one ? truth : -truth) : 0;
    return 1 / (1 + (1 - p) / p * std::exp(normal(engine) - known));
  };
  stages::join_likely(graph, rule, {probability, [&](int) { teller.changed(); }});
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Pairs of parts of labelled table scenes, for train_joins.py");
  fs::path folder, file;
  std::string set;
  app.add_option("folder", folder)->required()->check(CLI::ExistingDirectory);
  app.add_option("set", set, "the scenes whose name begins so")->required();
  app.add_option("pairs", file, "the table to write")->required();
  stages::ImportParams params;
  app.add_option("--patch_m", params.patch_m, "import.patch_m");
  app.add_option("--concavity_deg", params.concavity_deg, "import.concavity_deg");
  app.add_option("--part_points", params.part_points, "import.part_points");
  int runs = 1;
  double noise = 1.5;
  app.add_option("--runs", runs, "how often to join as import does; with 0 only the bound is told");
  app.add_option("--noise", noise, "deviation of the logarithm of the odds there");
  double truth = 1;
  app.add_option("--truth", truth, "what the truth adds to or takes from that logarithm");
  CLI11_PARSE(app, argc, argv);
  std::ofstream out(file);
  std::vector<fs::path> scenes;
  for (const auto& entry : fs::directory_iterator(folder))
    if (entry.path().filename().string().starts_with(set)) scenes.push_back(entry.path());
  std::sort(scenes.begin(), scenes.end());
  int possible = 0;
  for (const auto& path : scenes) {
    geometry::Scene scene;
    scene.cloud = geometry::read_cloud(path, 1);
    const auto [table, standing, in_room] =
        stages::find_table(scene.cloud, {params.plane_tolerance_m, params.above_min_m, params.above_max_m,
                                         params.cluster_points, params.seed});
    const auto sight = stages::sight_of(scene.cloud);
    for (const auto& cluster :
         stages::clusters_of(scene.cloud, standing, std::max(params.cluster_gap_m, stages::most_gap_m),
                             params.cluster_points)) {
      const stages::PartRule rule{params.patch_m, params.concavity_deg, params.part_points, params.one_thing};
      const PartGraph start(scene.cloud, sight, cluster, table.plane, rule);
      for (int k = 0; k < runs; ++k) {
        PartGraph graph = start;
        Teller teller(out, path.stem().string(), scene.cloud);
        join_as_import(graph, rule, noise, truth, static_cast<std::uint64_t>(k), teller);
      }
      PartGraph graph = start;
      join_rightly(graph, scene.cloud);
      for (const auto& [name, points] : graph.parts())
        if (static_cast<int>(points.size()) >= params.cluster_points) scene.objects.push_back({"", points});
    }
    const auto match = tests::match_labels(scene, params.cluster_points);
    possible += match.one_each();
    if (runs == 0 && !match.one_each())
      fmt::print("{}: {} things gave {} objects: {} found, {} merged, {} split\n", path.stem().string(),
                 match.labelled, match.objects, match.found, match.merged, match.split);
  }
  fmt::print("{} of {} scenes could be right\n", possible, scenes.size());
}
