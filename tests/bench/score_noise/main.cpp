// How much do the scores of a mesh change when its surface is noisy, and how much do local features?
//   geocage_score_noise OUT [MESH | FOLDER]... [--unit NAME=UNIT]... [--seeds N]
// measures every mesh whose CSV is not in OUT yet, then writes OUT/summary.md and OUT/score-noise.svg.
// A mesh that is not a closed manifold, or does not remesh, is named and left out.
#include <algorithm>
#include <cstdio>
#include <map>

#include <fmt/format.h>

#include "pipeline/error.h"
#include "tests/bench/score_noise/measure.h"

namespace fs = std::filesystem;

namespace {

std::vector<fs::path> meshes_in(const fs::path& path) {
  if (!fs::is_directory(path)) return {path};
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(path))
    for (const char* kind : {".stl", ".off", ".ply", ".obj"})
      if (entry.path().extension() == kind) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  return files;
}

void measure_new(const fs::path& out, const fs::path& file, const std::string& unit,
                 const geocage::study::MeasureOptions& options) {
  const fs::path csv = out / (file.stem().string() + ".csv");
  if (fs::exists(csv)) return;
  fmt::print("{}\n", file.stem().string());
  std::fflush(stdout);
  try {
    geocage::study::measure(file, unit, options, csv.string() + ".part");
    fs::rename(csv.string() + ".part", csv);
  } catch (const geocage::pipeline::UserError& error) {
    fmt::print("{} is left out: {}\n", file.string(), error.what());
  }
}

}  // namespace

int main(int argc, char** argv) {
  const std::vector<std::string> words(argv + 1, argv + argc);
  if (words.empty()) {
    fmt::print("usage: geocage_score_noise OUT [MESH | FOLDER]... [--unit NAME=UNIT]... [--seeds N]\n");
    return 2;
  }
  geocage::study::MeasureOptions options;
  std::map<std::string, std::string> units;
  std::vector<fs::path> files;
  for (std::size_t i = 1; i < words.size(); ++i) {
    if (words[i] == "--unit" && i + 1 < words.size()) {
      const auto& word = words[++i];
      units[word.substr(0, word.find('='))] = word.substr(word.find('=') + 1);
    } else if (words[i] == "--seeds" && i + 1 < words.size()) {
      options.seeds = std::stoi(words[++i]);
    } else {
      for (const auto& file : meshes_in(words[i])) files.push_back(file);
    }
  }
  const fs::path out = words[0];
  fs::create_directories(out);
  for (const auto& file : files) {
    const auto unit = units.find(file.stem());
    measure_new(out, file, unit == units.end() ? "m" : unit->second, options);
  }
  geocage::study::summarise(out);
}
