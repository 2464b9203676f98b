// Own remesher against CGAL's isotropic_remeshing on the same input and target, in the same run:
//   geocage_remesh_study [-n VERTICES]... [-s SWEEPS] MESH...
// prints a row of a Markdown table for each mesh, target and remesher.
#include <algorithm>
#include <cmath>
#include <ctime>
#include <functional>

#include <fmt/format.h>

#include "geometry/crossings.h"
#include "geometry/mesh_files.h"
#include "geometry/surface_distance.h"
#include "stages/remesh/halfedges.h"
#include "stages/remesh/isotropic.h"
#include "stages/remesh/remesh.h"
#include "tests/bench/remesh_peer.h"

namespace geocage {
namespace {

double cpu_s() {
  timespec t;
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

/// The angle that one in a hundred triangles has as its smallest, or less.
double one_percent_angle_deg(const geometry::TriangleMesh& mesh) {
  std::vector<double> angles;
  for (const auto& t : mesh.triangles) {
    double least = M_PI;
    for (int i = 0; i < 3; ++i) {
      const auto &a = mesh.vertices[t[i]], &b = mesh.vertices[t[(i + 1) % 3]],
                 &c = mesh.vertices[t[(i + 2) % 3]];
      least = std::min(least, std::atan2((b - a).cross(c - a).norm(), (b - a).dot(c - a)));
    }
    angles.push_back(least);
  }
  std::sort(angles.begin(), angles.end());
  return angles[angles.size() / 100] * 180 / M_PI;
}

double regular_share(const geometry::TriangleMesh& mesh) {
  const auto rows = vertex_neighbours(mesh);
  int regular = 0;
  for (int v = 0; v < static_cast<int>(mesh.vertices.size()); ++v) regular += rows.size(v) == 6;
  return regular / static_cast<double>(mesh.vertices.size());
}

constexpr int cgal_sweeps = 10;

void row(const std::string& name, const char* tool, const geometry::TriangleMesh& input, int wanted,
         const std::function<geometry::TriangleMesh()>& work) {
  const double start = cpu_s();
  const auto mesh = work();
  const double seconds = cpu_s() - start;
  const auto before = check_mesh(input), after = check_mesh(mesh);
  const double spacing = before.diagonal_m() / 600;
  const auto lost = deviation(input, geometry::SurfaceDistance(mesh), spacing),
             added = deviation(mesh, geometry::SurfaceDistance(input), spacing);
  fmt::print(
      "| {} | {} | {} | {} | {:+.1f} % | {:.3f} | {:.1f} | {:.1f} | {:.0f} % | {:.1e} | {:.1e} | {}{}{} | "
      "{:.2f} |\n",
      name, wanted, tool, after.vertices, 100.0 * (after.vertices - wanted) / wanted, after.edge_cv,
      after.min_angle_rad * 180 / M_PI, one_percent_angle_deg(mesh), 100 * regular_share(mesh),
      std::hypot(lost.rms_m, added.rms_m) / std::sqrt(2.0) / before.diagonal_m(),
      std::max(lost.max_m, added.max_m) / before.diagonal_m(), geometry::crossing_triangles(mesh).size(),
      after.euler == before.euler ? "" : ", genus!", after.closed_manifold() ? "" : ", open!", seconds);
  std::fflush(stdout);
}

void study(const std::string& file, const std::vector<int>& targets, int sweeps) {
  auto raw = geometry::read_mesh(file);
  orient_outward(raw);
  const auto input = stages::Halfedges(raw).mesh();  // pinched vertices parted, for both
  const double area = check_mesh(input).area_m2;
  std::string name = file.substr(file.rfind('/') + 1);
  name = name.substr(0, name.rfind('.'));
  for (int n : targets) {
    row(name, "own", input, n, [&] { return stages::isotropic(input, n, sweeps); });
    const double h = std::sqrt(area / n / (std::sqrt(3.0) / 2));
    row(name, "CGAL", input, n, [&] { return cgal_remesh(input, h, cgal_sweeps); });
  }
}

}  // namespace
}  // namespace geocage

int main(int count, char** arguments) {
  std::vector<int> targets;
  std::vector<std::string> files;
  int sweeps = geocage::stages::RemeshParams().sweeps;
  for (int i = 1; i < count; ++i)
    if (std::string(arguments[i]) == "-n" && i + 1 < count)
      targets.push_back(std::stoi(arguments[++i]));
    else if (std::string(arguments[i]) == "-s" && i + 1 < count)
      sweeps = std::stoi(arguments[++i]);
    else
      files.emplace_back(arguments[i]);
  if (targets.empty()) targets = {5000, 20000};
  fmt::print(
      "| mesh | asked | by | V | V error | CV | min angle | 1 % angle | valence 6 | rms / diagonal | "
      "max / diagonal | cuts | CPU s |\n|---|---|---|---|---|---|---|---|---|---|---|---|---|\n");
  for (const auto& file : files) geocage::study(file, targets, sweeps);
}
