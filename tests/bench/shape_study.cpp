// Do the shapes that physics sees keep the mesh's size and holes? For every mesh of a folder, its distance
// field and its convex parts:
//   shape_study FOLDER|MESH [PART_MM]   (0: the field alone; halved where parts would lose handles)
// chi is of the solid: half of the mesh's V - E + F, and of the voxels of 0.5 mm inside (1 mm closes gaps of
// hammer and pitcher: rays, which know nothing of the field, say the same there). The field's error is
// against CGAL's exact distance at points within 5 mm of the surface, on both sides; what parts have outside
// the solid and leave out of it is what the field says at points 0.5 mm apart.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <random>

#include "physics/convex_parts.h"

#include "stages/field/field.h"
#include "tests/bench/exact_distance.h"
#include "tests/bench/study_objects.h"

namespace geocage::bench {
namespace {

using geometry::Vec3;

/// Largest errors, m.
struct Errors {
  double outside_m = 0, inside_m = 0;
};

Errors errors(const geometry::TriangleMesh& mesh, const geometry::SignedDistanceField& field) {
  const ExactDistance exact(mesh);
  std::mt19937_64 random(7);
  std::uniform_real_distribution<> unit(0, 1);
  Errors largest;
  for (int i = 0; i < 60000; ++i) {
    const auto& t =
        mesh.triangles[static_cast<std::size_t>(unit(random) * static_cast<double>(mesh.triangles.size()))];
    double u = unit(random), v = unit(random);
    if (u + v > 1) u = 1 - u, v = 1 - v;
    const Vec3 &a = mesh.vertices[t[0]], ab = mesh.vertices[t[1]] - a, ac = mesh.vertices[t[2]] - a;
    const Vec3 p = a + u * ab + v * ac + 0.01 * (unit(random) - 0.5) * ab.cross(ac).stableNormalized();
    const double value = field.value(p), error = std::abs(std::abs(value) - (p - exact.nearest(p)).norm());
    double& side = value >= 0 ? largest.outside_m : largest.inside_m;
    side = std::max(side, error);
  }
  return largest;
}

struct Outline {
  double excess_m = 0, left_out_m = 0;
};

Outline outline(Eigen::AlignedBox3d box, const geometry::SignedDistanceField& field,
                const std::vector<physics::ConvexPart>& parts) {
  constexpr double step = 0.5e-3;
  box.min() -= Vec3::Constant(2e-3), box.max() += Vec3::Constant(2e-3);
  const Eigen::Array3i n = physics::lattice_of(box, step);
  const std::vector<bool> covered = physics::covered_points(box, step, parts);
  Outline seen;
  std::size_t i = 0;
  for (int z = 0; z < n.z(); ++z)
    for (int y = 0; y < n.y(); ++y)
      for (int x = 0; x < n.x(); ++x, ++i) {
        const double value = field.value(box.min() + step * Vec3(x + 0.5, y + 0.5, z + 0.5));
        double& worst = covered[i] ? seen.excess_m : seen.left_out_m;
        worst = std::max(worst, covered[i] ? value : -value);
      }
  return seen;
}

}  // namespace
}  // namespace geocage::bench

int main(int argc, char** argv) {
  using namespace geocage::bench;
  namespace geometry = geocage::geometry;
  namespace physics = geocage::physics;
  if (argc < 2) return std::fprintf(stderr, "shape_study FOLDER|MESH [PART_MM]\n"), 2;
  const double tolerance_m = argc > 2 ? 1e-3 * std::atof(argv[2]) : 0;
  std::printf(
      "| object | chi | field: chi, pieces | worst mm outside, inside | tolerance mm | parts | s | chi, "
      "pieces | outside mm "
      "| "
      "left out mm | "
      "volume %% "
      "|\n|---|---|---|---|---|---|---|---|---|---|---|\n");
  for (const auto& [name, mesh] : objects_of(argv[1])) {
    geocage::pipeline::Run run;
    const auto field = geocage::stages::field({}, run, mesh);
    Eigen::AlignedBox3d box;
    for (const auto& p : mesh.vertices) box.extend(p);
    const long chi =
        (static_cast<long>(mesh.vertices.size()) - static_cast<long>(mesh.triangles.size()) / 2) / 2;
    constexpr double voxel_m = 5e-4;
    const auto of_field =
        physics::voxel_shape(box, voxel_m, [&](const geometry::Vec3& p) { return field.value(p) < 0; });
    physics::FaithfulParts faithful;
    const std::clock_t start = std::clock();
    if (tolerance_m > 0) faithful = physics::faithful_parts(mesh, field, tolerance_m, voxel_m);
    const auto& parts = faithful.parts;
    const double seconds = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
    const auto of_parts = physics::voxel_shape(box, voxel_m, parts);
    const Outline seen = parts.empty() ? Outline{} : outline(box, field, parts);
    const Errors worst = errors(mesh, field);
    std::printf("| %s | %ld | %ld, %d | %.2f, %.2f | %.3g | %zu | %.1f | %ld, %d | %.2f | %.2f | %+.1f |\n",
                name.c_str(), chi, of_field.euler, of_field.pieces, 1e3 * worst.outside_m,
                1e3 * worst.inside_m, 1e3 * faithful.tolerance_m, parts.size(), seconds, of_parts.euler,
                of_parts.pieces, 1e3 * seen.excess_m, 1e3 * seen.left_out_m,
                100 * (of_parts.volume_m3 / geometry::mass_properties(mesh).volume_m3 - 1));
    std::fflush(stdout);
  }
  return 0;
}
