// Writhe of a pair of segments, with its derivatives and without, against the arcsine form of the thesis (eq.
// 3.1, without derivatives), which is what it replaces.
#include <algorithm>
#include <cmath>
#include <random>

#include <benchmark/benchmark.h>

#include "topology/writhe.h"

namespace geocage {
namespace {

using topology::Polyline;
using topology::Vec3;

constexpr int points = 33;  // 32 x 32 pairs

Polyline chain(std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<> even(-1, 1);
  Polyline line(points);
  for (Vec3& p : line) p = {even(random), even(random), even(random)};
  return line;
}

double arcsine_writhe(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  const Vec3 ac = c - a, ad = d - a, bd = d - b, bc = c - b;
  const Vec3 na = ac.cross(ad).normalized(), nb = ad.cross(bd).normalized(), nc = bd.cross(bc).normalized(),
             nd = bc.cross(ac).normalized();
  const auto arc = [](double x) { return std::asin(std::clamp(x, -1.0, 1.0)); };
  const double sum = arc(na.dot(nb)) + arc(nb.dot(nc)) + arc(nc.dot(nd)) + arc(nd.dot(na));
  return (b - a).dot(ac.cross(d - c)) > 0 ? sum : -sum;
}

void count_pairs(benchmark::State& state) {
  state.SetItemsProcessed(state.iterations() * (points - 1) * (points - 1));
}

void writhe_with_gradient(benchmark::State& state) {
  const auto first = chain(1), second = chain(2);
  topology::WritheField field(points, points);
  for (auto _ : state) {
    field.evaluate(first, second);
    benchmark::DoNotOptimize(field.omega_sr().data());
  }
  count_pairs(state);
}

void writhe_value(benchmark::State& state) {
  const auto first = chain(1), second = chain(2);
  for (auto _ : state) benchmark::DoNotOptimize(topology::writhe_matrix(first, second));
  count_pairs(state);
}

void arcsine_value(benchmark::State& state) {
  const auto first = chain(1), second = chain(2);
  for (auto _ : state) {
    double sum = 0;
    for (int i = 0; i + 1 < points; ++i)
      for (int j = 0; j + 1 < points; ++j)
        sum += arcsine_writhe(first[i], first[i + 1], second[j], second[j + 1]);
    benchmark::DoNotOptimize(sum);
  }
  count_pairs(state);
}

BENCHMARK(writhe_with_gradient)->Unit(benchmark::kMicrosecond);
BENCHMARK(writhe_value)->Unit(benchmark::kMicrosecond);
BENCHMARK(arcsine_value)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace geocage
