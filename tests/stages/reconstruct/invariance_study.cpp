// How far reconstruct's surface moves with what should change nothing but rounding: the order of points, a
// turn, and noise that vanishes; a torus of 104 mm.
//   build/release/invariance_study
#include <cmath>
#include <random>

#include <fmt/format.h>

#include "datasets/shapes.h"
#include "geometry/surface_distance.h"
#include "stages/reconstruct/reconstruct.h"

namespace {

using namespace geocage;
using geometry::PointCloud;
using geometry::TriangleMesh;
using geometry::Vec3;

PointCloud cloud_of(const TriangleMesh& mesh, double sigma_m) {
  std::mt19937_64 random(1);
  std::normal_distribution<> noise(0, 1);
  PointCloud cloud;
  cloud.normals = vertex_normals(mesh);
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i)
    cloud.points.push_back(mesh.vertices[i] + sigma_m * noise(random) * cloud.normals[i]);
  return cloud;
}

TriangleMesh surface(const PointCloud& cloud, int depth) {
  pipeline::Run run;
  stages::ReconstructParams params;
  if (depth > 0) params.depth = depth;
  return stages::reconstruct(params, run, cloud);
}

double hausdorff_mm(const TriangleMesh& a, const TriangleMesh& b) {
  return 1e3 * std::max(deviation(a, geometry::SurfaceDistance(b), 0.001).max_m,
                        deviation(b, geometry::SurfaceDistance(a), 0.001).max_m);
}

PointCloud shuffled(PointCloud cloud) {
  std::mt19937_64 random(3);
  for (std::size_t i = cloud.size() - 1; i > 0; --i) {
    const std::size_t j = random() % (i + 1);
    std::swap(cloud.points[i], cloud.points[j]);
    std::swap(cloud.normals[i], cloud.normals[j]);
  }
  return cloud;
}

/// No two of its axes alike, and each with one end larger than the other.
TriangleMesh pear() {
  TriangleMesh mesh = datasets::icosphere(0.05, 5);
  for (Vec3& p : mesh.vertices) {
    const Vec3 n = p.normalized();
    p = (1 + 0.3 * n.z() + 0.15 * n.x() * n.z() + 0.1 * n.y() * n.y() * n.y()) *
        p.cwiseProduct(Vec3(0.7, 0.85, 1));
  }
  return mesh;
}

void print_rows(const std::string& name, const TriangleMesh& object, int depth) {
  const auto print_row = [&](const std::string& change, double moved_mm) {
    fmt::print("| {} | {} | {} | {:.6f} |\n", name, depth > 0 ? std::to_string(depth) : "default", change,
               moved_mm);
  };
  const auto clean = cloud_of(object, 0), noisy = cloud_of(object, 3e-4);
  const auto base = surface(clean, depth), noisy_base = surface(noisy, depth);
  print_row("order of points (0.3 mm of noise)", hausdorff_mm(surface(shuffled(noisy), depth), noisy_base));
  for (double angle : {0.3, 0.7, 1.1}) {
    const Eigen::Matrix3d R = Eigen::AngleAxisd(angle, Vec3(1, 2, -1).normalized()).toRotationMatrix();
    auto cloud = clean;
    auto moved = base;
    for (auto* list : {&cloud.points, &cloud.normals, &moved.vertices})
      for (Vec3& p : *list) p = R * p;
    print_row(fmt::format("turned by {} rad", angle), hausdorff_mm(moved, surface(cloud, depth)));
  }
  for (double sigma : {3e-4, 3e-5, 3e-6, 3e-7})
    print_row(fmt::format("noise of {:.4f} mm", 1e3 * sigma),
              hausdorff_mm(surface(cloud_of(object, sigma), depth), base));
}

}  // namespace

int main() {
  fmt::print("| object | octree depth | change | moved / mm (two-sided Hausdorff) |\n|---|---|---|---|\n");
  for (const auto& [name, object] :
       {std::pair{"torus", datasets::torus(0.04, 0.012, 120, 40)}, {"pear", pear()}})
    for (int depth : {0, 7}) print_rows(name, object, depth);
}
