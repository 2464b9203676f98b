// Peak memory of `ball_fields` beyond the mesh, in bytes a vertex, from what operator new gives out.
// Usage: geocage_balls_memory
#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <new>

#include <fmt/format.h>
#include <malloc.h>
#include <omp.h>

#include "datasets/shapes.h"
#include "topology/balls.h"

namespace {

std::atomic<std::size_t> in_use{0}, peak{0};

void* counted(void* p) {
  if (p == nullptr) throw std::bad_alloc();
  const std::size_t now = in_use += malloc_usable_size(p);
  for (std::size_t most = peak; now > most && !peak.compare_exchange_weak(most, now);) continue;
  return p;
}

}  // namespace

void* operator new(std::size_t size) {
  return counted(std::malloc(std::max<std::size_t>(size, 1)));
}
void* operator new(std::size_t size, std::align_val_t align) {
  const std::size_t to = static_cast<std::size_t>(align);
  return counted(std::aligned_alloc(to, (std::max<std::size_t>(size, 1) + to - 1) / to * to));
}
void operator delete(void* p) noexcept {
  if (p != nullptr) in_use -= malloc_usable_size(p);
  std::free(p);
}
void operator delete(void* p, std::size_t) noexcept {
  operator delete(p);
}
void operator delete(void* p, std::align_val_t) noexcept {
  operator delete(p);
}
void operator delete(void* p, std::size_t, std::align_val_t) noexcept {
  operator delete(p);
}

/// With any argument: the smaller mesh only.
int main(int argc, char**) {
  using namespace geocage;
  fmt::print(
      "| vertices | metric | radii | threads | peak, bytes a vertex | of these the answer "
      "|\n|---|---|---|---|---|---|\n");
  for (const auto& [along, around] : {std::pair{260, 78}, std::pair{516, 155}}) {
    if (argc > 1 && along > 260) continue;
    const auto mesh = datasets::torus(1, 0.3, along, around);
    const double largest_m = 0.25 * check_mesh(mesh).diagonal_m();
    for (const auto metric : {topology::Metric::hop, topology::Metric::dijkstra})
      for (const int radii : {1, 10})
        for (const int threads : {1, 2}) {
          omp_set_num_threads(threads);
          std::vector<double> list;
          for (int i = 1; i <= radii; ++i) list.push_back(largest_m * i / radii);
          const std::size_t before = in_use;
          peak = before;
          const auto set = topology::ball_fields(mesh, list, metric);
          const auto each = [&](std::size_t bytes) {
            return static_cast<double>(bytes - before) / static_cast<double>(mesh.vertices.size());
          };
          fmt::print("| {} | {} | {} | {} | {:.0f} | {:.0f} |\n", mesh.vertices.size(),
                     metric == topology::Metric::hop ? "hop" : "dijkstra", radii, threads, each(peak),
                     each(in_use));
        }
  }
}
