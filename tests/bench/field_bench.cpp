// The signed distance field: building, and one look, with its gradient or without, against the exact distance
// by CGAL's AABB tree.
#include <random>

#include <CGAL/AABB_face_graph_triangle_primitive.h>
#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <benchmark/benchmark.h>
#include <omp.h>

#include "datasets/shapes.h"
#include "geometry/cgal_mesh.h"
#include "geometry/distance_field.h"

namespace geocage {
namespace {

const geometry::TriangleMesh& cup() {
  static const auto mesh = datasets::cup(0.04, 0.1, 0.003, 96);
  return mesh;
}

/// 500 segments of 40 mm anywhere around the cup, 20 points along each: as capsules' axes are looked at.
std::vector<geometry::Vec3> points() {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<> unit(-0.06, 0.06);
  const auto drawn = [&] { return geometry::Vec3(unit(random), unit(random), unit(random)); };
  std::vector<geometry::Vec3> list;
  for (int segment = 0; segment < 500; ++segment) {
    const geometry::Vec3 from = drawn() + geometry::Vec3(0, 0, 0.05), along = drawn().normalized();
    for (int i = 0; i < 20; ++i) list.emplace_back(from + 0.002 * i * along);
  }
  return list;
}

void build(benchmark::State& state) {
  omp_set_num_threads(1);
  for (auto _ : state)
    benchmark::DoNotOptimize(
        geometry::build_distance_field(cup(), {static_cast<int>(state.range(0)), 0.04, 3}));
}

void look(benchmark::State& state) {
  const auto field = geometry::build_distance_field(cup(), {64, 0.04, 3});
  const auto list = points();
  for (auto _ : state)
    for (const auto& p : list) benchmark::DoNotOptimize(field.value(p));
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(list.size()));
}

void look_with_gradient(benchmark::State& state) {
  const auto field = geometry::build_distance_field(cup(), {64, 0.04, 3});
  const auto list = points();
  geometry::Vec3 gradient;
  for (auto _ : state)
    for (const auto& p : list) benchmark::DoNotOptimize(field.value(p, gradient));
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(list.size()));
}

void cgal_distance(benchmark::State& state) {
  using Primitive = CGAL::AABB_face_graph_triangle_primitive<geometry::CgalMesh>;
  const auto mesh = geometry::to_cgal(cup());
  CGAL::AABB_tree<CGAL::AABB_traits<geometry::CgalKernel, Primitive>> tree(faces(mesh).first,
                                                                           faces(mesh).second, mesh);
  tree.accelerate_distance_queries();
  const auto list = points();
  for (auto _ : state)
    for (const auto& p : list) benchmark::DoNotOptimize(tree.squared_distance({p.x(), p.y(), p.z()}));
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(list.size()));
}

BENCHMARK(build)->Arg(32)->Arg(64)->Unit(benchmark::kMillisecond);
BENCHMARK(look)->Unit(benchmark::kMicrosecond);
BENCHMARK(look_with_gradient)->Unit(benchmark::kMicrosecond);
BENCHMARK(cgal_distance)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace geocage
