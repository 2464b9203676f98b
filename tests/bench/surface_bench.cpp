// Surfaces through 100k oriented points of a bumpy ball with noise of 0.5 % of its radius: wall seconds of
// each method against pcl::Poisson in the same run, with CPU seconds (of the child processes too) and the
// mean distance to the true ball as counters.
#include <cmath>
#include <random>

#include <benchmark/benchmark.h>
#include <sys/resource.h>

#include "stages/reconstruct/reconstruct.h"

namespace geocage {
namespace {

double radius_m(const geometry::Vec3& direction) {
  return 0.05 * (1 + 0.1 * std::sin(5 * direction.x()) * std::cos(4 * direction.y() + direction.z()));
}

geometry::PointCloud bumpy_ball(int count) {
  std::mt19937_64 random(1);
  std::normal_distribution<> noise(0, 0.00025);
  geometry::PointCloud cloud;
  for (int i = 0; i < count; ++i) {
    const double z = 1 - (2 * i + 1.0) / count, angle = i * M_PI * (3 - std::sqrt(5.0)),
                 r = std::sqrt(1 - z * z);
    const geometry::Vec3 d(r * std::cos(angle), r * std::sin(angle), z);
    const Eigen::Matrix3d frame = geometry::frame_from_z(d);
    const auto at = [](const geometry::Vec3& v) {
      return (radius_m(v.normalized()) * v.normalized()).eval();
    };
    constexpr double h = 1e-5;
    const geometry::Vec3 normal =
        (at(d + h * frame.col(0)) - at(d)).cross(at(d + h * frame.col(1)) - at(d)).normalized();
    cloud.points.push_back(at(d) + noise(random) * normal);
    cloud.normals.push_back(normal);
  }
  return cloud;
}

double cpu_s() {
  double sum = 0;
  for (int who : {RUSAGE_SELF, RUSAGE_CHILDREN}) {
    rusage used{};
    getrusage(who, &used);
    for (const timeval& t : {used.ru_utime, used.ru_stime})
      sum += static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  }
  return sum;
}

void surface(benchmark::State& state, const std::string& method) {
  const auto cloud = bumpy_ball(100000);
  stages::ReconstructParams params;
  params.method = method;
  params.timeout_s = 600;
  geometry::TriangleMesh mesh;
  const double before_s = cpu_s();
  for (auto _ : state) {
    pipeline::Run run;
    mesh = stages::reconstruct(params, run, cloud);
  }
  state.counters["cpu_s"] = cpu_s() - before_s;
  double sum = 0;
  for (const auto& p : mesh.vertices) sum += std::abs(p.norm() - radius_m(p.normalized()));
  state.counters["mean_off_mm"] = 1e3 * sum / static_cast<double>(mesh.vertices.size());
  state.counters["vertices"] = static_cast<double>(mesh.vertices.size());
}

// The methods work in worker processes, whose time is not this process's: what the table calls CPU is this
// process waiting, cpu_s is all of it.
BENCHMARK_CAPTURE(surface, poisson, std::string("poisson"))
    ->UseRealTime()
    ->Unit(benchmark::kSecond)
    ->Iterations(1);
BENCHMARK_CAPTURE(surface, cgal_poisson, std::string("cgal_poisson"))
    ->UseRealTime()
    ->Unit(benchmark::kSecond)
    ->Iterations(1);
BENCHMARK_CAPTURE(surface, advancing_front, std::string("advancing_front"))
    ->UseRealTime()
    ->Unit(benchmark::kSecond)
    ->Iterations(1);
BENCHMARK_CAPTURE(surface, alpha_wrap, std::string("alpha_wrap"))
    ->UseRealTime()
    ->Unit(benchmark::kSecond)
    ->Iterations(1);

}  // namespace
}  // namespace geocage
