// Remeshing a torus, own and CGAL's. Arguments: wanted vertices. geocage_remesh_study compares quality.
#include <benchmark/benchmark.h>

#include "datasets/shapes.h"
#include "stages/remesh/isotropic.h"
#include "stages/remesh/remesh.h"
#include "tests/bench/remesh_peer.h"

namespace geocage {
namespace {

const geometry::TriangleMesh& ring() {
  static const auto mesh = datasets::torus(0.04, 0.012, 160, 60);
  return mesh;
}

void own_remesh(benchmark::State& state) {
  for (auto _ : state)
    benchmark::DoNotOptimize(
        stages::isotropic(ring(), static_cast<int>(state.range(0)), stages::RemeshParams().sweeps));
}

void cgal_isotropic_remeshing(benchmark::State& state) {
  const double edge_m =
      std::sqrt(check_mesh(ring()).area_m2 / static_cast<double>(state.range(0)) / (std::sqrt(3.0) / 2));
  for (auto _ : state) benchmark::DoNotOptimize(cgal_remesh(ring(), edge_m, 10));
}

BENCHMARK(own_remesh)->Arg(5000)->Arg(20000)->Unit(benchmark::kMillisecond);
BENCHMARK(cgal_isotropic_remeshing)->Arg(5000)->Arg(20000)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace geocage
