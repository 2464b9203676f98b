// The full study of defects: every mutator on every mesh of a folder, with several seeds.
//   build/release/defect_study --objects DIR [--seeds 5] [--seed-from 1] [--object NAME] [--mutator NAME]
//   [--wrap-alpha A] [--csv FILE]
// Exit code 0 when every mesh was repaired and passes CGAL's own check, or was rejected with a reason.
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "geometry/median.h"
#include "geometry/mesh_files.h"
#include "pipeline/error.h"
#include "pipeline/worker.h"
#include "tests/defects/trial.h"

namespace {

namespace fs = std::filesystem;
using geocage::geometry::TriangleMesh;

using geocage::tests::Trial;

struct Row : Trial {
  std::string object;
};

/// A mesh scaled to a diagonal of 0.2 m; empty when it can't be read.
TriangleMesh read_scaled(const fs::path& file) {
  try {
    auto mesh = geocage::pipeline::contained<TriangleMesh>(
        {30, 4}, file.string(), [&] { return geocage::geometry::read_mesh(file); });
    const double scale = 0.2 / check_mesh(mesh).diagonal_m();
    for (auto& p : mesh.vertices) p *= scale;
    return mesh;
  } catch (const geocage::pipeline::UserError&) {
    return {};
  }
}

void print_table(const std::vector<Row>& rows) {
  fmt::print(
      "| defect | runs | untouched | repaired | wrapped | rejected | bad | seconds median, most | "
      "moved median, most [% of diagonal] |\n|---|---|---|---|---|---|---|---|---|\n");
  for (const auto& mutator : geocage::tests::mutators()) {
    std::map<std::string, int> count;
    std::vector<double> seconds, moved;
    int bad = 0;
    for (const Row& row : rows) {
      if (row.mutator != mutator.name) continue;
      ++count[row.outcome];
      bad += !row.good;
      seconds.push_back(row.seconds);
      if (row.outcome == "repaired" || row.outcome == "wrapped") moved.push_back(100 * row.moved);
    }
    if (seconds.empty()) continue;
    const auto most = [](const std::vector<double>& x) {
      return x.empty() ? 0 : *std::max_element(x.begin(), x.end());
    };
    fmt::print("| {} | {} | {} | {} | {} | {} | {} | {:.2f}, {:.2f} | {:.2f}, {:.2f} |\n", mutator.name,
               seconds.size(), count["untouched"], count["repaired"], count["wrapped"], count["rejected"],
               bad, geocage::geometry::median(seconds), most(seconds), geocage::geometry::median(moved),
               most(moved));
  }
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Every defect on every mesh of a folder");
  fs::path folder, csv;
  std::string only, mutator_name;
  std::uint64_t seeds = 5, seed_from = 1;
  geocage::geometry::RepairParams params;
  app.add_option("--objects", folder, "folder of closed meshes")->required()->check(CLI::ExistingDirectory);
  app.add_option("--object", only, "only this one");
  app.add_option("--mutator", mutator_name, "only this one");
  app.add_option("--seeds", seeds, "how many");
  app.add_option("--seed-from", seed_from, "the first of them");
  app.add_option("--wrap-alpha", params.wrap_alpha, "in diagonals");
  app.add_option("--csv", csv, "every run as a line");
  CLI11_PARSE(app, argc, argv);

  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder)) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  std::map<std::string, TriangleMesh> meshes;
  for (const auto& file : files)
    if (only.empty() || file.stem() == only)
      if (auto mesh = read_scaled(file); !mesh.triangles.empty())
        meshes.emplace(file.stem(), std::move(mesh));
  std::ofstream out;
  if (!csv.empty()) out.open(csv);
  out << "object,mutator,seed,outcome,good,seconds,moved_diagonals,reason\n";
  std::vector<Row> rows;
  for (std::uint64_t seed = seed_from; seed < seed_from + seeds; ++seed)
    for (const auto& [name, mesh] : meshes)
      for (const auto& mutator : geocage::tests::mutators()) {
        if (!mutator_name.empty() && mutator_name != mutator.name) continue;
        rows.push_back({try_defect(mutator, mesh, seed, params), name});
        const Row& row = rows.back();
        if (!row.good)
          fmt::print(stderr, "{} / {} / seed {}: {}\n", row.object, row.mutator, row.seed, row.reason);
        out << fmt::format("{},{},{},{},{},{:.4f},{:.6f},\"{}\"\n", row.object, row.mutator, row.seed,
                           row.outcome, row.good, row.seconds, row.moved, row.reason)
            << std::flush;
      }
  print_table(rows);
  const auto bad = std::count_if(rows.begin(), rows.end(), [](const Row& row) { return !row.good; });
  fmt::print("\n{} runs, {} bad\n", rows.size(), bad);
  return rows.empty() || bad > 0;
}
