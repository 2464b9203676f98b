#pragma once
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "geometry/mesh.h"
#include "geometry/mesh_files.h"
#include "geometry/repair.h"

namespace geocage::bench {

/// The words of "a,b,c".
inline std::vector<std::string> split(const std::string& text) {
  std::vector<std::string> parts;
  std::stringstream stream(text);
  for (std::string part; std::getline(stream, part, ',');) parts.push_back(part);
  return parts;
}

/// The meshes of a folder, or the one of a file, turned outward, by name. Those that are no closed manifolds
/// are mended, or else left out, and named on stderr.
inline std::vector<std::pair<std::string, geometry::TriangleMesh>> objects_of(
    const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  if (std::filesystem::is_regular_file(folder)) {
    files.push_back(folder);
  } else {
    for (const auto& entry : std::filesystem::directory_iterator(folder)) {
      const std::string kind = entry.path().extension();
      if (kind == ".stl" || kind == ".ply" || kind == ".off" || kind == ".obj") files.push_back(entry.path());
    }
  }
  std::sort(files.begin(), files.end());
  std::vector<std::pair<std::string, geometry::TriangleMesh>> objects;
  for (const auto& file : files) {
    auto mesh = geometry::read_mesh(file);
    geometry::orient_outward(mesh);
    auto report = geometry::check_mesh(mesh);
    if (!report.closed_manifold()) {
      auto mended = geometry::repair_mesh(mesh);
      if (mended.outcome == geometry::RepairOutcome::rejected) {
        std::fprintf(stderr, "%s is left out: %s\n", file.c_str(), mended.reason.c_str());
        continue;
      }
      std::fprintf(stderr, "%s is mended: %s\n", file.c_str(), geometry::flaw(report).c_str());
      mesh = std::move(mended.mesh);
      report = geometry::check_mesh(mesh);
    }
    if (report.diagonal_m() > 0.6) {  // no unit is known: a hand-sized object
      std::fprintf(stderr, "%s is scaled by %g\n", file.c_str(), 0.2 / report.diagonal_m());
      for (auto& p : mesh.vertices) p *= 0.2 / report.diagonal_m();
    }
    objects.emplace_back(file.stem(), std::move(mesh));
  }
  return objects;
}

}  // namespace geocage::bench
