// Loops of a torus of 20,000 vertices and of two joined ones of 20,000 in all.
#include <benchmark/benchmark.h>
#include <omp.h>

#include "datasets/shapes.h"
#include "topology/loops.h"

namespace geocage {
namespace {

void handle_loops(benchmark::State& state, const geometry::TriangleMesh& mesh) {
  omp_set_num_threads(1);
  for (auto _ : state) benchmark::DoNotOptimize(topology::handle_loops(mesh));
}

BENCHMARK_CAPTURE(handle_loops, torus, datasets::torus(0.05, 0.015, 250, 80))->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(handle_loops, double_torus, datasets::double_torus(0.05, 0.015, 170, 59))
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace geocage
