// How often the things of a table scene become one object each:
//   build/release/table_study --set tuning|held_out|fresh|unseen|trial|wide|varied|varied_2|varied_3|rooms|
//   rooms_trial|far_rooms|far_rooms_trial [--objects DIR]
//   [--rule gap] [--rule shape] [--rule lccp] [--rule lccp_extended] [--one_thing 0.5] [--part_points 600]
//   [--keep FOLDER [--write]] [--scene NAME] [--from_seed 0] [--to_seed 160]
// --keep writes each scene as a labelled PCD, and reads it where it is there already.
#include <chrono>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "pipeline/error.h"
#include "stages/import/import.h"
#include "tests/pipeline/scratch_folder.h"
#include "tests/stages/import/label_match.h"
#include "tests/stages/import/locally_convex.h"
#include "tests/stages/import/table_scenes.h"

namespace fs = std::filesystem;
using namespace geocage;

int main(int argc, char** argv) {
  CLI::App app("Things of table scenes before the virtual Kinect, and the objects that import makes of them");
  std::string set = "tuning", only;
  bool write_only = false;
  fs::path objects, keep;
  std::vector<std::string> rules = {"gap", "shape"};
  app.add_option("--set", set, "which scenes")
      ->check(CLI::IsMember({"tuning", "held_out", "fresh", "unseen", "training", "training_varied",
                             "training_low", "trial", "wide", "varied", "varied_2", "varied_3", "rooms",
                             "rooms_trial", "far_rooms", "far_rooms_trial"}));
  app.add_option("--objects", objects, "folder of the shared meshes")->check(CLI::ExistingDirectory);
  app.add_option("--rule", rules,
                 "values of import.cluster_by; lccp, lccp_extended: PCL's (locally_convex.h)");
  stages::ImportParams params{.scene = "table"};
  app.add_option("--one_thing", params.one_thing, "import.one_thing");
  app.add_option("--part_points", params.part_points, "import.part_points");
  app.add_option("--keep", keep, "folder for the scenes")->check(CLI::ExistingDirectory);
  app.add_flag("--write", write_only, "only write the scenes");
  app.add_option("--scene", only, "only this one");
  tests::Seeds seeds;
  app.add_option("--from_seed", seeds.from, "of sets of chance");
  app.add_option("--to_seed", seeds.to, "and less than this");
  CLI11_PARSE(app, argc, argv);
  const tests::ScratchFolder scratch;
  std::map<std::string, int> right;
  std::map<std::string, tests::LabelMatch> totals;
  int doubtful[2] = {0, 0};  // wrong and right ones that say so
  int all = 0;
  for (const auto& scene : tests::table_scenes(set, objects, seeds)) {
    if (!only.empty() && scene.name != only) continue;
    for (const auto& view : scene.views) {
      const fs::path file = (keep.empty() ? scratch.path() : keep) /
                            fmt::format("{}-{}-{:.0f}.pcd", set, scene.name, view.elevation_deg);
      if (!fs::exists(file)) tests::write_seen(scene, view, file);
      if (write_only) continue;
      ++all;
      for (const auto& rule : rules) {
        std::string how;
        const auto start = std::chrono::steady_clock::now();
        try {
          pipeline::Run run;
          params.cluster_by = rule;
          const bool peer = rule.starts_with("lccp");
          const auto found = peer ? tests::locally_convex_objects(file, rule == "lccp_extended")
                                  : stages::find_scene(params, run, {file});
          const auto match = tests::match_labels(found, params.cluster_points);
          if (const auto told = run.metrics().find("doubtful"); told != run.metrics().end())
            doubtful[match.one_each()] += told->second > 0;
          auto& total = totals[rule];
          total.labelled += match.labelled;
          total.found += match.found;
          total.merged += match.merged;
          total.split += match.split;
          total.objects += match.objects;
          total.points += match.points;
          total.pure += match.pure;
          if (match.one_each()) {
            ++right[rule];
            continue;
          }
          how = fmt::format("{} things gave {} objects: {} found, {} merged, {} split", match.labelled,
                            match.objects, match.found, match.merged, match.split);
        } catch (const pipeline::UserError& error) {
          how = error.what();
        }
        const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
        fmt::print("{}, {:.0f} degrees, {}: {} ({:.1f} s)\n", rule, view.elevation_deg, scene.name, how,
                   took.count());
      }
    }
  }
  for (const auto& rule : rules) {
    const auto& total = totals[rule];
    fmt::print(
        "{}: {} of {} scenes right; {} things, {} objects; things found {}, in another's object {}, cut {}; "
        "{:.2f} % of points in an object of another thing\n",
        rule, right[rule], all, total.labelled, total.objects, total.found, total.merged, total.split,
        100.0 * (total.points - total.pure) / std::max(1, total.points));
  }
  fmt::print("in doubt: {} wrong ones, {} right ones\n", doubtful[0], doubtful[1]);
}
