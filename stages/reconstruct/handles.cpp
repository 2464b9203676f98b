#include "stages/reconstruct/handles.h"

#include <algorithm>

#include "geometry/holes.h"
#include "geometry/repair.h"
#include "geometry/soup.h"
#include "topology/loops.h"

namespace geocage::stages {

using geometry::TriangleMesh;
using topology::SurfaceLoop;

namespace {

/// The mesh without the triangles of some strips, closed again.
TriangleMesh cut_along(const TriangleMesh& mesh, const std::vector<int>& crossed) {
  std::vector<char> keep(mesh.triangles.size(), 1);
  for (int f : crossed) keep[f] = 0;
  geometry::RepairCounts counts;
  TriangleMesh cut = geometry::cut_to_manifold(geometry::kept_triangles(mesh, keep), counts);
  geometry::part_touching_vertices(cut);
  geometry::fill_holes(cut, static_cast<int>(cut.triangles.size()));
  return cut;
}

/// True where the triangles have a vertex that `taken` marks; marks theirs otherwise.
bool meets(const TriangleMesh& mesh, const std::vector<int>& crossed, std::vector<char>& taken) {
  for (int f : crossed)
    for (int v : mesh.triangles[f])
      if (taken[v]) return true;
  for (int f : crossed)
    for (int v : mesh.triangles[f]) taken[v] = 1;
  return false;
}

/// What one look at a mesh's loops allows to cut.
struct Round {
  TriangleMesh mesh;
  int handles = 0;
  double longest_m = 0;
};

/// Loops that keep clear of each other, one after the other on the numbers of `mesh`, each only where a solid
/// with one handle less comes of it.
Round cut_round(const TriangleMesh& mesh, int euler, double loop_m) {
  std::vector<char> taken(mesh.vertices.size(), 0);
  std::vector<int> all;
  Round round;
  for (const SurfaceLoop& loop : topology::handle_loops(mesh)) {
    if (loop.length_m >= loop_m) continue;
    if (meets(mesh, loop.strip, taken)) continue;
    auto with = all;
    with.insert(with.end(), loop.strip.begin(), loop.strip.end());
    TriangleMesh cut = cut_along(mesh, with);
    if (check_mesh(cut).euler != euler + 2 * (round.handles + 1) || !geometry::flaw_of_solid(cut).empty())
      continue;
    all = std::move(with);
    round.mesh = std::move(cut);
    ++round.handles;
    round.longest_m = std::max(round.longest_m, loop.length_m);
  }
  return round;
}

}  // namespace

CutHandles cut_small_handles(TriangleMesh& mesh, double loop_m) {
  CutHandles done;
  mesh.observed.clear();
  for (int euler = check_mesh(mesh).euler; euler != 2; euler = check_mesh(mesh).euler) {
    const Round round = cut_round(mesh, euler, loop_m);
    if (round.handles == 0) break;
    mesh = round.mesh;
    done.handles += round.handles;
    done.moved_m = std::max(done.moved_m, round.longest_m / 2);
  }
  return done;
}

}  // namespace geocage::stages
