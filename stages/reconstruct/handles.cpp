#include "stages/reconstruct/handles.h"

#include <algorithm>

#include "geometry/holes.h"
#include "geometry/repair.h"
#include "geometry/soup.h"
#include "geometry/surface_distance.h"
#include "topology/loops.h"

namespace geocage::stages {

using geometry::TriangleMesh;
using topology::SurfaceLoop;

namespace {

/// The triangles that a loop runs through.
std::vector<int> crossed_by(const SurfaceLoop& loop, const geometry::SurfaceDistance& surface) {
  std::vector<int> crossed;
  const auto count = loop.path.size();
  int nearest = 0;
  for (std::size_t i = 0; i < count; ++i) {
    surface.distance_m((loop.path[i] + loop.path[(i + 1) % count]) / 2, nearest);  // sets `nearest`
    crossed.push_back(nearest);
  }
  std::sort(crossed.begin(), crossed.end());
  crossed.erase(std::unique(crossed.begin(), crossed.end()), crossed.end());
  return crossed;
}

/// The mesh without those triangles, closed again.
TriangleMesh cut_along(const TriangleMesh& mesh, const std::vector<int>& crossed) {
  std::vector<char> keep(mesh.triangles.size(), 1);
  for (int f : crossed) keep[f] = 0;
  geometry::RepairCounts counts;
  TriangleMesh cut = geometry::cut_to_manifold(geometry::kept_triangles(mesh, keep), counts);
  geometry::part_touching_vertices(cut);
  geometry::fill_holes(cut, static_cast<int>(cut.triangles.size()));
  return cut;
}

/// True where loops passes vertices that `taken` marks; marks its own otherwise.
bool meets(const TriangleMesh& mesh, const std::vector<int>& crossed, std::vector<char>& taken) {
  for (int f : crossed)
    for (int v : mesh.triangles[f])
      if (taken[v]) return true;
  for (int f : crossed)
    for (int v : mesh.triangles[f]) taken[v] = 1;
  return false;
}

}  // namespace

CutHandles cut_small_handles(TriangleMesh& mesh, double loop_m) {
  CutHandles done;
  mesh.observed.clear();
  for (bool again = true; again;) {
    again = false;
    const int euler = check_mesh(mesh).euler;
    if (euler == 2) break;
    const geometry::SurfaceDistance surface(mesh);
    std::vector<std::pair<std::vector<int>, double>> cuts;
    std::vector<char> taken(mesh.vertices.size(), 0);
    for (const SurfaceLoop& loop : topology::handle_loops(mesh)) {
      if (loop.length_m >= loop_m) continue;
      auto crossed = crossed_by(loop, surface);
      if (!meets(mesh, crossed, taken)) cuts.emplace_back(std::move(crossed), loop.length_m);
    }
    // One after the other on the old numbers: all at once, and one by one where that is no solid.
    std::vector<int> all;
    const auto solid_with = [&](const std::vector<int>& crossed, int fewer) {
      TriangleMesh cut = cut_along(mesh, crossed);
      const bool good = check_mesh(cut).euler == euler + 2 * fewer && geometry::flaw_of_solid(cut).empty();
      return good ? cut : TriangleMesh();
    };
    TriangleMesh best;
    int fewer = 0;
    for (const auto& [crossed, length_m] : cuts) {
      auto with = all;
      with.insert(with.end(), crossed.begin(), crossed.end());
      TriangleMesh cut = solid_with(with, fewer + 1);
      if (cut.triangles.empty()) continue;
      ++fewer;
      all = std::move(with);
      best = std::move(cut);
      done.moved_m = std::max(done.moved_m, length_m / 2);
    }
    if (fewer == 0) break;
    mesh = std::move(best);
    done.handles += fewer;
    again = true;
  }
  return done;
}

}  // namespace geocage::stages
