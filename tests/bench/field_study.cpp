// How near is the distance field to the truth? For every mesh of a folder and each number of cells:
//   field_study FOLDER|MESH [ERROR_MM [CELLS ...]]
// ERROR_MM is what cells near the surface are parted down to (FieldGrid::error_m; 0: they are not).
// Points at exact clearances of 0 to 5 mm outside (CGAL's AABB tree); one CSV line an object and grid. Errors
// are field less truth in mm; angles are between the field's gradient and the direction from the nearest
// point.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <random>

#include <omp.h>

#include "geometry/distance_field.h"
#include "tests/bench/exact_distance.h"
#include "tests/bench/study_objects.h"

namespace geocage::bench {
namespace {

using geometry::Vec3;

double uniform(std::mt19937_64& random) {
  return static_cast<double>(random() >> 11) * 0x1p-53;
}

/// The processor's time of this thread.
double cpu_s() {
  timespec now;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

struct Errors {
  std::vector<double> distance_mm, angle_deg;
};

/// At points up to 5 mm off random triangles, along their normals; those that are nearer to elsewhere count
/// as they are.
Errors errors(const geometry::TriangleMesh& mesh, const geometry::SignedDistanceField& field,
              const ExactDistance& exact) {
  std::mt19937_64 random(3);
  Errors all;
  while (all.distance_mm.size() < 20000) {
    const auto& t = mesh.triangles[static_cast<std::size_t>(uniform(random) *
                                                            static_cast<double>(mesh.triangles.size()))];
    double u = uniform(random), v = uniform(random);
    if (u + v > 1) u = 1 - u, v = 1 - v;
    const Vec3 &a = mesh.vertices[t[0]], ab = mesh.vertices[t[1]] - a, ac = mesh.vertices[t[2]] - a;
    const Vec3 p = a + u * ab + v * ac + 0.005 * uniform(random) * ab.cross(ac).normalized();
    Vec3 gradient;
    const double value = field.value(p, gradient);
    if (value < 0) continue;  // through a thin wall, inside
    const Vec3 away = p - exact.nearest(p);
    all.distance_mm.push_back(1e3 * (value - away.norm()));
    if (away.norm() > 1e-4)
      all.angle_deg.push_back(180 / M_PI *
                              std::acos(std::clamp(gradient.normalized().dot(away.normalized()), -1.0, 1.0)));
  }
  std::sort(all.distance_mm.begin(), all.distance_mm.end());
  std::sort(all.angle_deg.begin(), all.angle_deg.end());
  return all;
}

double at(const std::vector<double>& sorted, double share) {
  return sorted[static_cast<std::size_t>(share * static_cast<double>(sorted.size() - 1))];
}

int run(int argc, char** argv) {
  if (argc < 2) return std::fprintf(stderr, "field_study FOLDER|MESH [ERROR_MM [CELLS ...]]\n"), 2;
  omp_set_num_threads(1);
  geometry::FieldGrid grid{.pad_m = 0.04};
  if (argc > 2) grid.error_m = 1e-3 * std::atof(argv[2]);
  std::vector<int> sizes;
  for (int i = 3; i < argc; ++i) sizes.push_back(std::atoi(argv[i]));
  if (sizes.empty()) sizes = {64, 128};
  std::printf(
      "object,cells,error_mm,cell_mm,fine_nodes,cpu_s,p2_mm,p98_mm,min_mm,max_mm,angle_p50_deg,angle_p90_deg,"
      "angle_p98_"
      "deg\n");
  for (const auto& [name, mesh] : objects_of(argv[1])) {
    const ExactDistance exact(mesh);
    for (int cells : sizes) {
      grid.cells = cells;
      const double start = cpu_s();
      const auto field = geometry::build_distance_field(mesh, grid);
      const double seconds = cpu_s() - start;
      const Errors e = errors(mesh, field, exact);
      std::printf("%s,%d,%.3f,%.2f,%zu,%.2f,%.3f,%.3f,%.3f,%.3f,%.1f,%.1f,%.1f\n", name.c_str(), cells,
                  1e3 * grid.error_m, 1e3 * field.cell_m, field.fine.size(), seconds, at(e.distance_mm, 0.02),
                  at(e.distance_mm, 0.98), e.distance_mm.front(), e.distance_mm.back(), at(e.angle_deg, 0.5),
                  at(e.angle_deg, 0.9), at(e.angle_deg, 0.98));
      std::fflush(stdout);
    }
  }
  return 0;
}

}  // namespace
}  // namespace geocage::bench

int main(int argc, char** argv) {
  return geocage::bench::run(argc, argv);
}
