// Geodesic balls with curvature, axis and winding angle of every vertex, against Boost's bounded Dijkstra,
// which gives the ball alone. Arguments: percent of the diagonal.
#include <benchmark/benchmark.h>
#include <boost/graph/compressed_sparse_row_graph.hpp>
#include <boost/graph/dijkstra_shortest_paths.hpp>
#include <omp.h>

#include "datasets/shapes.h"
#include "topology/balls.h"

namespace geocage {
namespace {

const geometry::TriangleMesh& ball() {
  static const auto mesh = datasets::icosphere(0.05, 4);
  return mesh;
}
double radius_m(const benchmark::State& state) {
  return check_mesh(ball()).diagonal_m() * static_cast<double>(state.range(0)) / 100;
}

void all_fields(benchmark::State& state, topology::Metric metric) {
  omp_set_num_threads(1);
  for (auto _ : state) benchmark::DoNotOptimize(topology::ball_fields(ball(), {radius_m(state)}, metric));
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(ball().vertices.size()));
}

struct Beyond {};
struct Bound : boost::dijkstra_visitor<> {
  double radius;
  const std::vector<double>* distance;
  template <class Vertex, class Graph>
  void examine_vertex(Vertex v, const Graph&) const {
    if ((*distance)[v] > radius) throw Beyond();
  }
};

void boost_ball(benchmark::State& state) {
  using Graph = boost::compressed_sparse_row_graph<boost::directedS, boost::no_property,
                                                   boost::property<boost::edge_weight_t, double>>;
  const auto& mesh = ball();
  const auto rows = vertex_neighbours(mesh);
  std::vector<std::pair<std::size_t, std::size_t>> edges;
  std::vector<double> lengths;
  for (int v = 0; v < static_cast<int>(mesh.vertices.size()); ++v)
    for (int i = rows.start[v]; i < rows.start[v + 1]; ++i) {
      edges.emplace_back(v, rows.items[i]);
      lengths.push_back((mesh.vertices[v] - mesh.vertices[rows.items[i]]).norm());
    }
  const Graph graph(boost::edges_are_sorted, edges.begin(), edges.end(), lengths.begin(),
                    mesh.vertices.size());
  std::vector<double> distance(mesh.vertices.size());
  for (auto _ : state)
    for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
      Bound bound;
      bound.radius = radius_m(state);
      bound.distance = &distance;
      try {
        boost::dijkstra_shortest_paths(graph, v, boost::distance_map(distance.data()).visitor(bound));
      } catch (const Beyond&) {  // the ball is complete
      }
      benchmark::DoNotOptimize(distance.data());
    }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(mesh.vertices.size()));
}

BENCHMARK_CAPTURE(all_fields, hop, topology::Metric::hop)->Arg(10)->Arg(25)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(all_fields, dijkstra, topology::Metric::dijkstra)
    ->Arg(10)
    ->Arg(25)
    ->Unit(benchmark::kMillisecond);
BENCHMARK(boost_ball)->Arg(10)->Arg(25)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace geocage
