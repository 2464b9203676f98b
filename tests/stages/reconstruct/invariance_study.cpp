// How far reconstruct's surface moves with what should change nothing but rounding: the order of points, a
// turn, and noise that vanishes; a torus of 104 mm, and a pear, which no turn brings to itself.
//   build/release/invariance_study
#include <fmt/format.h>

#include "stages/reconstruct/reconstruct.h"
#include "tests/stages/reconstruct/surface_changes.h"

namespace {

using namespace geocage;
using geometry::PointCloud;
using geometry::TriangleMesh;

TriangleMesh surface(const PointCloud& cloud, int depth) {
  pipeline::Run run;
  stages::ReconstructParams params;
  if (depth > 0) params.depth = depth;
  return stages::reconstruct(params, run, cloud);
}

double hausdorff_mm(const TriangleMesh& a, const TriangleMesh& b) {
  return 1e3 * tests::hausdorff_m(a, b);
}

void print_rows(const std::string& name, const TriangleMesh& object, int depth) {
  const auto print_row = [&](const std::string& change, double moved_mm) {
    fmt::print("| {} | {} | {} | {:.6f} |\n", name, depth > 0 ? std::to_string(depth) : "default", change,
               moved_mm);
  };
  const auto clean = tests::cloud_of(object, 0), noisy = tests::cloud_of(object, 3e-4);
  const auto base = surface(clean, depth), noisy_base = surface(noisy, depth);
  print_row("order of points (0.3 mm of noise)",
            hausdorff_mm(surface(tests::shuffled(noisy), depth), noisy_base));
  for (double angle : {0.3, 0.7, 1.1}) {
    auto cloud = clean;
    auto moved = base;
    tests::turn(cloud, moved, angle);
    print_row(fmt::format("turned by {} rad", angle), hausdorff_mm(moved, surface(cloud, depth)));
  }
  for (double sigma : {3e-4, 3e-5, 3e-6, 3e-7})
    print_row(fmt::format("noise of {:.4f} mm", 1e3 * sigma),
              hausdorff_mm(surface(tests::cloud_of(object, sigma), depth), base));
}

}  // namespace

int main() {
  fmt::print("| object | octree depth | change | moved / mm (two-sided Hausdorff) |\n|---|---|---|---|\n");
  for (const auto& [name, object] :
       {std::pair{"torus", datasets::torus(0.04, 0.012, 120, 40)}, {"pear", tests::pear()}})
    for (int depth : {0, 7}) print_rows(name, object, depth);
}
