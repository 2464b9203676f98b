// Pairs of parts of table scenes, what tells whether they are one thing, and whether they are, for
// train_joins.py:
//   build/release/table_study --set training --keep FOLDER [--objects DIR]
//   build/release/part_pairs FOLDER training PAIRS.csv
// Pairs of the parts as they come, and again each time that half of what belongs together has been joined.
// Says at last in how many scenes right joins alone make an object of each thing: the best that joins can do.
#include <fstream>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <fmt/ostream.h>

#include "geometry/cloud_files.h"
#include "stages/import/import.h"
#include "stages/import/part_graph.h"
#include "stages/import/table.h"
#include "tests/stages/import/label_match.h"

namespace fs = std::filesystem;
using namespace geocage;
using stages::PartGraph;

namespace {

/// The label that most points of each part have; 0 only where none has another.
std::map<int, int> things_of(const PartGraph& graph, const geometry::PointCloud& cloud) {
  std::map<int, int> thing;
  for (const auto& [name, points] : graph.parts()) {
    std::map<int, int> votes;
    for (int i : points)
      if (cloud.label[i] != 0) ++votes[cloud.label[i]];
    const auto most = std::max_element(votes.begin(), votes.end(),
                                       [](const auto& a, const auto& b) { return a.second < b.second; });
    thing[name] = most == votes.end() ? 0 : most->first;
  }
  return thing;
}

/// Joins the first half of pairs, of which earlier joins rename some.
void join_half(PartGraph& graph, const std::vector<PartGraph::Pair>& pairs) {
  std::map<int, int> now;
  const auto name_of = [&](int name) {
    while (now.contains(name)) name = now[name];
    return name;
  };
  for (std::size_t k = 0; k < (pairs.size() + 1) / 2; ++k) {
    const PartGraph::Pair pair = std::minmax(name_of(pairs[k].first), name_of(pairs[k].second));
    if (pair.first == pair.second) continue;
    graph.join(pair);
    now[pair.second] = pair.first;
  }
}

void tell_pairs(std::ostream& out, const std::string& scene, PartGraph& graph,
                const geometry::PointCloud& cloud) {
  for (bool joined = true; joined;) {
    const auto thing = things_of(graph, cloud);
    const auto size = graph.sizes();
    std::vector<PartGraph::Pair> same;
    for (const auto& pair : graph.pairs()) {
      const bool one = thing.at(pair.first) == thing.at(pair.second);
      if (one) same.push_back(pair);
      const auto [smaller, larger] = std::minmax(size.at(pair.first), size.at(pair.second));
      fmt::print(out, "{},{},{},{}", scene, static_cast<int>(one), smaller, larger);
      for (double value : graph.evidence(pair).value) fmt::print(out, ",{:.5g}", value);
      fmt::print(out, "\n");
    }
    std::stable_sort(same.begin(), same.end(), [&](const auto& a, const auto& b) {
      return size.at(a.first) + size.at(a.second) > size.at(b.first) + size.at(b.second);
    });
    join_half(graph, same);
    joined = !same.empty();
  }
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Pairs of parts of labelled table scenes, for train_joins.py");
  fs::path folder, file;
  std::string set;
  app.add_option("folder", folder)->required()->check(CLI::ExistingDirectory);
  app.add_option("set", set, "the scenes whose name begins so")->required();
  app.add_option("pairs", file, "the table to write")->required();
  CLI11_PARSE(app, argc, argv);
  std::ofstream out(file);
  fmt::print(out, "scene,one,smaller,larger,{}\n", fmt::join(stages::Evidence::names, ","));
  std::vector<fs::path> scenes;
  for (const auto& entry : fs::directory_iterator(folder))
    if (entry.path().filename().string().starts_with(set)) scenes.push_back(entry.path());
  std::sort(scenes.begin(), scenes.end());
  const stages::ImportParams params;
  int possible = 0;
  for (const auto& path : scenes) {
    geometry::Scene scene;
    scene.cloud = geometry::read_cloud(path, 1);
    const auto table = stages::find_plane(scene.cloud, params.plane_tolerance_m, params.seed);
    const auto sight = stages::sight_of(scene.cloud);
    const auto standing = stages::standing_on(scene.cloud, table, params.above_min_m, params.above_max_m);
    for (const auto& cluster :
         stages::clusters_of(scene.cloud, standing, params.cluster_gap_m, params.cluster_points)) {
      PartGraph graph(scene.cloud, sight, cluster, table.plane,
                      {params.patch_m, params.concavity_deg, params.part_points, params.one_thing});
      tell_pairs(out, path.stem().string(), graph, scene.cloud);
      for (const auto& [name, points] : graph.parts())
        if (static_cast<int>(points.size()) >= params.cluster_points) scene.objects.push_back({"", points});
    }
    possible += tests::match_labels(scene, params.cluster_points).one_each();
  }
  fmt::print("{} of {} scenes could be right\n", possible, scenes.size());
}
