// Geodesic balls with curvature, area, Euler number, axis and winding angle of every vertex, against Boost's
// bounded Dijkstra, which gives the ball alone, and against the plain implementation. Arguments: mesh
// (kilo-vertices, about), percent of the diagonal, and shape (0: dented torus, 1: sphere). The counter `ball`
// is the mean number of vertices of a ball. The peers look at every 50th vertex; items are sources, so that
// items per second compare. Run with --benchmark_enable_random_interleaving=true
// --benchmark_repetitions=3: peers side by side.
#include <cmath>
#include <cstdlib>
#include <map>

#include <benchmark/benchmark.h>
#include <boost/graph/adjacency_list.hpp>
#include <boost/graph/compressed_sparse_row_graph.hpp>
#include <boost/graph/dijkstra_shortest_paths.hpp>
#include <boost/graph/dijkstra_shortest_paths_no_color_map.hpp>
#include <omp.h>

#include "datasets/shapes.h"
#include "stages/remesh/isotropic.h"
#include "stages/remesh/remesh.h"
#include "tests/bench/study_objects.h"
#include "topology/ball_mesh.h"
#include "topology/lane_balls.h"
#include "topology/plain_balls.h"

namespace geocage {
namespace {

using topology::Metric;

enum Shape { dented_torus, round_sphere, bumpy_sphere, first_object };

/// The objects of the folder that GEOCAGE_TEST_OBJECTS names, if it does.
const std::vector<std::pair<std::string, geometry::TriangleMesh>>& objects() {
  static const auto read = [] {
    const char* folder = std::getenv("GEOCAGE_TEST_OBJECTS");
    return folder ? bench::objects_of(folder) : decltype(bench::objects_of(""))();
  }();
  return read;
}

/// About so many vertices, all triangles of about the same size: balls of a torus' tube meet themselves,
/// those of a sphere are discs. The bumpy sphere and the objects have the net that the stage `remesh` gives.
geometry::TriangleMesh make_shape(std::int64_t shape, double vertices) {
  const auto count = static_cast<int>(vertices);
  const int sweeps = stages::RemeshParams().sweeps;
  if (shape >= first_object)
    return stages::isotropic(objects()[static_cast<std::size_t>(shape - first_object)].second, count, sweeps);
  if (shape == bumpy_sphere) {
    auto mesh = datasets::icosphere(1, 5);
    for (geometry::Vec3& p : mesh.vertices)
      p *= 1 + 0.1 * std::sin(5 * p.x() + 1) * std::sin(4 * p.y()) * std::cos(6 * p.z());
    return stages::isotropic(mesh, count, sweeps);
  }
  if (shape == round_sphere) {
    auto mesh = datasets::box({2, 2, 2}, static_cast<int>(std::lround(std::sqrt(vertices / 6))));
    for (geometry::Vec3& p : mesh.vertices) p = geometry::Vec3((M_PI / 4 * (p.array())).tan()).normalized();
    return mesh;
  }
  const int around = static_cast<int>(std::lround(std::sqrt(vertices * 0.3)));
  auto mesh = datasets::torus(1, 0.3, static_cast<int>(around / 0.3), around);
  for (geometry::Vec3& p : mesh.vertices)
    p *= 1 + 0.2 * std::sin(5.3 * p.x() + 0.7 * p.y() - 0.4) * std::cos(4 * p.z() + p.x());
  return mesh;
}

/// Its vertices in the order of a Hilbert curve: what helps the lanes shall help the peers.
const geometry::TriangleMesh& surface(const benchmark::State& state) {
  static std::map<std::pair<std::int64_t, std::int64_t>, geometry::TriangleMesh> meshes;
  const std::pair key(state.range(0), state.range(2));
  if (const auto found = meshes.find(key); found != meshes.end()) return found->second;
  const auto mesh = make_shape(key.second, static_cast<double>(key.first) * 1000);
  const auto original = topology::BallMesh(mesh).original;
  geometry::TriangleMesh ordered;
  std::vector<int> rank(original.size());
  for (int v : original) {
    rank[v] = static_cast<int>(ordered.vertices.size());
    ordered.vertices.push_back(mesh.vertices[v]);
  }
  for (const auto& t : mesh.triangles) ordered.triangles.push_back({rank[t[0]], rank[t[1]], rank[t[2]]});
  return meshes.emplace(key, ordered).first->second;
}
double radius_m(const benchmark::State& state) {
  return check_mesh(surface(state)).diagonal_m() * static_cast<double>(state.range(1)) / 100;
}
/// Evenly spaced up to the asked one.
std::vector<double> radii_of(const benchmark::State& state, int count) {
  std::vector<double> radii;
  for (int i = 1; i <= count; ++i) radii.push_back(radius_m(state) * i / count);
  return radii;
}
std::vector<int> some_sources(const geometry::TriangleMesh& mesh) {
  std::vector<int> sources;
  for (int v = 0; v < static_cast<int>(mesh.vertices.size()); v += 50) sources.push_back(v);
  return sources;
}
void count_items(benchmark::State& state, std::size_t sources) {
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(sources));
  state.counters["us/source"] =
      benchmark::Counter(static_cast<double>(sources) * 1e-6,
                         benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}

void lanes(benchmark::State& state, Metric metric, int radii, bool winding, int threads) {
  omp_set_num_threads(threads);
  const auto& mesh = surface(state);
  const auto list = radii_of(state, radii);
  topology::BallOptions options;
  options.winding = winding;
  topology::BallSet set;
  for (auto _ : state) benchmark::DoNotOptimize(set = topology::ball_fields(mesh, list, metric, options));
  count_items(state, mesh.vertices.size());
  double ball = 0;
  for (int count : set.radii.back().ball_vertices) ball += count;
  state.counters["ball"] = ball / static_cast<double>(mesh.vertices.size());
}

/// The mesh laid out before, as the peers' graphs are.
void lanes_again(benchmark::State& state, Metric metric, int radii, bool winding) {
  omp_set_num_threads(1);
  const auto& mesh = surface(state);
  topology::BallOptions options;
  options.winding = winding;
  const auto list = radii_of(state, radii);
  topology::LaneBalls balls(mesh);
  topology::BallSet set;
  for (auto _ : state) benchmark::DoNotOptimize(set = balls.fields(list, metric, options));
  count_items(state, mesh.vertices.size());
}

void plain(benchmark::State& state, Metric metric) {
  omp_set_num_threads(1);
  const auto& mesh = surface(state);
  const auto sources = some_sources(mesh);
  topology::PlainBalls balls(mesh, metric, {});
  topology::BallSet set;
  set.radii.push_back(topology::BallFields::of_size(mesh.vertices.size(), radius_m(state)));
  for (auto _ : state) balls.measure(sources, set);
  count_items(state, sources.size());
}

struct Beyond {};
/// Stops behind the radius, and notes whose distance has to be made infinite again: no work that grows with
/// the mesh.
struct Bound : boost::dijkstra_visitor<> {
  double radius;
  const std::vector<double>* distance;
  std::vector<std::size_t>* touched;
  std::size_t* settled;
  template <class Vertex, class Graph>
  void examine_vertex(Vertex v, const Graph&) const {
    if ((*distance)[v] > radius) throw Beyond();
    ++*settled;
  }
  template <class Edge, class Graph>
  void edge_relaxed(Edge e, const Graph& graph) const {
    touched->push_back(target(e, graph));
  }
};

/// Links of a mesh in both directions, by their tails, and their lengths.
struct Roads {
  std::vector<std::pair<std::size_t, std::size_t>> ends;
  std::vector<double> lengths_m;
  explicit Roads(const geometry::TriangleMesh& mesh) {
    const auto rows = vertex_neighbours(mesh);
    for (int v = 0; v < static_cast<int>(mesh.vertices.size()); ++v)
      for (int i = rows.start[v]; i < rows.start[v + 1]; ++i) {
        ends.emplace_back(v, rows.items[i]);
        lengths_m.push_back((mesh.vertices[v] - mesh.vertices[rows.items[i]]).norm());
      }
  }
};
using Weight = boost::property<boost::edge_weight_t, double>;

template <class Graph, class Search, class Forget>
void run_boost(benchmark::State& state, const Graph& graph, const Search& search, const Forget& forget) {
  const std::size_t n = num_vertices(graph);
  std::vector<double> distance(n, std::numeric_limits<double>::infinity());
  std::vector<std::size_t> touched;
  std::size_t settled = 0;
  Bound bound;
  bound.radius = radius_m(state);
  bound.distance = &distance;
  bound.touched = &touched;
  bound.settled = &settled;
  const auto sources = some_sources(surface(state));
  for (auto _ : state) {
    settled = 0;
    for (int v : sources) {
      touched.assign(1, static_cast<std::size_t>(v));
      distance[v] = 0;
      try {
        search(static_cast<std::size_t>(v), distance, bound);
      } catch (const Beyond&) {  // the ball is complete
      }
      benchmark::DoNotOptimize(distance.data());
      for (std::size_t w : touched) {
        distance[w] = std::numeric_limits<double>::infinity();
        forget(w);
      }
    }
  }
  count_items(state, sources.size());
  state.counters["ball"] = static_cast<double>(settled) / static_cast<double>(sources.size());
}

/// Boost's fastest way: a compressed graph, no colours.
void boost_ball(benchmark::State& state) {
  using Graph = boost::compressed_sparse_row_graph<boost::directedS, boost::no_property, Weight>;
  const Roads roads(surface(state));
  const Graph graph(boost::edges_are_sorted, roads.ends.begin(), roads.ends.end(), roads.lengths_m.begin(),
                    surface(state).vertices.size());
  run_boost(
      state, graph,
      [&](std::size_t v, std::vector<double>& distance, const Bound& bound) {
        boost::dijkstra_shortest_paths_no_color_map_no_init(
            graph, v, boost::dummy_property_map(), distance.data(), get(boost::edge_weight, graph),
            get(boost::vertex_index, graph), std::less<>(), std::plus<>(),
            std::numeric_limits<double>::infinity(), 0.0, bound);
      },
      [](std::size_t) {});
}

/// Boost's usual way: lists of edges at each vertex, and `dijkstra_shortest_paths_no_init`, whose colours are
/// made white again for those touched.
void boost_ball_lists(benchmark::State& state) {
  using Graph =
      boost::adjacency_list<boost::vecS, boost::vecS, boost::undirectedS, boost::no_property, Weight>;
  const Roads roads(surface(state));
  Graph graph(surface(state).vertices.size());
  for (std::size_t i = 0; i < roads.ends.size(); ++i)
    if (const auto [from, to] = roads.ends[i]; from < to) add_edge(from, to, roads.lengths_m[i], graph);
  std::vector<boost::default_color_type> colours(num_vertices(graph), boost::white_color);
  const auto map_of = [&](auto& values) {
    return boost::make_iterator_property_map(values.begin(), get(boost::vertex_index, graph));
  };
  run_boost(
      state, graph,
      [&](std::size_t v, std::vector<double>& distance, const Bound& bound) {
        boost::dijkstra_shortest_paths_no_init(
            graph, v, boost::dummy_property_map(), map_of(distance), get(boost::edge_weight, graph),
            get(boost::vertex_index, graph), std::less<>(), std::plus<>(), 0.0, bound, map_of(colours));
      },
      [&](std::size_t v) { colours[v] = boost::white_color; });
}

void small_sizes(benchmark::internal::Benchmark* bench) {
  for (int shape : {dented_torus, round_sphere, bumpy_sphere})
    for (int percent : {10, 25}) bench->Args({20, percent, shape})->Unit(benchmark::kMillisecond);
}
void sizes(benchmark::internal::Benchmark* bench) {
  small_sizes(bench);
  bench->Args({80, 10, dented_torus})->Args({80, 25, dented_torus});
}
BENCHMARK(boost_ball)->Apply(sizes);
BENCHMARK(boost_ball_lists)->Apply(sizes);
BENCHMARK_CAPTURE(plain, hop, Metric::hop)->Apply(sizes);
BENCHMARK_CAPTURE(lanes, hop, Metric::hop, 1, true, 1)->Apply(sizes);
BENCHMARK_CAPTURE(lanes, dijkstra, Metric::dijkstra, 1, true, 1)->Apply(small_sizes);
BENCHMARK_CAPTURE(lanes, dijkstra_sums, Metric::dijkstra, 1, false, 1)->Apply(small_sizes);
BENCHMARK_CAPTURE(lanes, hop_sums, Metric::hop, 1, false, 1)->Apply(small_sizes);
BENCHMARK_CAPTURE(lanes, hop_sums_ten_radii, Metric::hop, 10, false, 1)->Apply(small_sizes);
BENCHMARK_CAPTURE(lanes, hop_ten_radii, Metric::hop, 10, true, 1)->Apply(small_sizes);
BENCHMARK_CAPTURE(lanes, dijkstra_ten_radii, Metric::dijkstra, 10, true, 1)->Apply(small_sizes);
BENCHMARK_CAPTURE(lanes_again, hop, Metric::hop, 1, true)->Apply(small_sizes);
BENCHMARK_CAPTURE(lanes_again, dijkstra, Metric::dijkstra, 1, true)->Apply(small_sizes);
BENCHMARK_CAPTURE(lanes_again, hop_ten_radii, Metric::hop, 10, true)->Apply(small_sizes);
BENCHMARK_CAPTURE(lanes, hop_two_threads, Metric::hop, 1, true, 2)
    ->Apply(small_sizes)
    ->MeasureProcessCPUTime()
    ->UseRealTime();

/// objects/<what>/<name>/<percent>
const bool objects_are_listed = [] {
  for (std::size_t i = 0; i < objects().size(); ++i)
    for (const int percent : {10, 25}) {
      const auto list = [&](const std::string& what, auto function) {
        benchmark::RegisterBenchmark(
            ("objects/" + what + "/" + objects()[i].first + "/" + std::to_string(percent)).c_str(), function)
            ->Args({20, percent, first_object + static_cast<int>(i)})
            ->Unit(benchmark::kMillisecond);
      };
      list("boost_ball", boost_ball);
      list("boost_ball_lists", boost_ball_lists);
      list("lanes", [](benchmark::State& state) { lanes(state, Metric::hop, 1, true, 1); });
      list("lanes_again", [](benchmark::State& state) { lanes_again(state, Metric::hop, 1, true); });
      list("lanes_again_dijkstra",
           [](benchmark::State& state) { lanes_again(state, Metric::dijkstra, 1, true); });
    }
  return true;
}();

}  // namespace
}  // namespace geocage
