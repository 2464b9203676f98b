// Closes hands on every mesh of a folder from random places and checks each closing against the exact mesh:
//   closing_study FOLDER [POSES [HAND ...]]       FOLDER or one mesh file: a study can be split by object
// One CSV line an object and hand. `deepest` counts from dense samples (1 mm) along the axes of the closed
// hand's capsules; `on_the_way` from samples (5 mm) at every posture that the hand goes through, which a
// finger that jumps through a thin wall would show in.
#include <cstdio>
#include <ctime>
#include <numbers>
#include <random>

#include "geometry/distance_field.h"
#include "hands/caging.h"
#include "hands/closing.h"
#include "tests/bench/exact_distance.h"
#include "tests/bench/study_objects.h"

namespace geocage::bench {
namespace {

using geometry::Pose;
using geometry::Vec3;

double uniform(std::mt19937_64& random) {
  return static_cast<double>(random() >> 11) * 0x1p-53;
}

/// The processor's time of this thread: a closing is shorter than what another program may take in between.
double cpu_ms() {
  timespec now;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
}

double deepest_m(const ExactDistance& exact, const std::vector<hands::PlacedCapsule>& placed,
                 double spacing_m) {
  double deepest = 0;
  for (const auto& capsule : placed) {
    const int n = 1 + static_cast<int>((capsule.b - capsule.a).norm() / spacing_m);
    for (int i = 0; i <= n; ++i)
      deepest =
          std::max(deepest, capsule.radius_m - exact(capsule.a + double(i) / n * (capsule.b - capsule.a)));
  }
  return deepest;
}

/// A hand that comes along the normal of a random vertex with a random turn and stops 2 to 30 mm before it
/// touches.
Pose random_pose(const hands::Hand& hand, const geometry::SignedDistanceField& field,
                 const geometry::TriangleMesh& mesh, const std::vector<Vec3>& normals,
                 std::mt19937_64& random) {
  const auto v = static_cast<std::size_t>(uniform(random) * static_cast<double>(normals.size()));
  const double far = 0.6;
  Pose X_OH = Pose::Identity();
  const auto turn = Eigen::AngleAxisd(2 * std::numbers::pi * uniform(random), normals[v]);
  X_OH.linear() =
      turn * geometry::frame_from_z(-normals[v]) * geometry::frame_from_z(hand.approach_H).transpose();
  X_OH.translation() = mesh.vertices[v] + far * normals[v] - X_OH.linear() * hand.palm_H;
  const auto travel =
      hands::free_travel_m(field, hands::placed_capsules(hand, X_OH, hand.open_rad), -normals[v], far);
  X_OH.translation() -= (travel.value_or(far) - 0.002 - 0.028 * uniform(random)) * normals[v];
  return X_OH;
}

struct Row {
  int closed = 0, limits = 0, backwards = 0;
  double deepest_m = 0, on_the_way_m = 0;
  std::vector<double> milliseconds;
};

void check(const hands::Hand& hand, const ExactDistance& exact, const Pose& X_OH,
           const hands::ClosedHand& closed, const std::vector<Eigen::VectorXd>& path, Row& row) {
  row.deepest_m =
      std::max(row.deepest_m, deepest_m(exact, hands::placed_capsules(hand, X_OH, closed.q), 0.001));
  for (std::size_t k = 0; k < path.size(); ++k) {
    row.on_the_way_m =
        std::max(row.on_the_way_m, deepest_m(exact, hands::placed_capsules(hand, X_OH, path[k]), 0.005));
    row.limits += ((path[k] - hand.tree.lower_rad).minCoeff() < -1e-12) ||
                  ((hand.tree.upper_rad - path[k]).minCoeff() < -1e-12);
    if (k > 0) row.backwards += (path[k] - path[k - 1]).cwiseProduct(hand.closing_rad).minCoeff() < 0;
  }
}

Row study(const hands::Hand& hand, const geometry::TriangleMesh& mesh,
          const geometry::SignedDistanceField& field, const ExactDistance& exact, int poses) {
  Row row;
  std::mt19937_64 random(7);
  const auto normals = geometry::vertex_normals(mesh);
  for (int tries = 0; row.closed < poses && tries < 20 * poses; ++tries) {
    const Pose X_OH = random_pose(hand, field, mesh, normals, random);
    const double start = cpu_ms();
    const auto closed = hands::close_hand(hand, field, X_OH, hand.open_rad, {});
    const double ms = cpu_ms() - start;
    if (closed.outcome != hands::Closure::closed) continue;
    ++row.closed;
    row.milliseconds.push_back(ms);
    std::vector<Eigen::VectorXd> path;
    hands::close_hand(hand, field, X_OH, hand.open_rad, {}, &path);
    check(hand, exact, X_OH, closed, path, row);
  }
  std::sort(row.milliseconds.begin(), row.milliseconds.end());
  return row;
}

int run(int argc, char** argv) {
  if (argc < 2) return std::fprintf(stderr, "closing_study FOLDER|MESH [POSES [HAND ...]]\n"), 2;
  const int poses = argc > 2 ? std::atoi(argv[2]) : 20;
  std::vector<std::string> names(argv + std::min(argc, 3), argv + argc);
  if (names.empty()) names = hands::hand_names();
  std::printf("object,hand,closings,deepest_mm,on_the_way_mm,over_limits,backwards,median_ms,p90_ms\n");
  for (const auto& [name, mesh] : objects_of(argv[1])) {
    const auto field = geometry::build_distance_field(mesh, {.cells = 64, .pad_m = 0.04, .refine = 3});
    const ExactDistance exact(mesh);
    for (const auto& hand_name : names) {
      const auto hand = hands::load_hand(hand_name);
      if (hand.tree.dofs() == 0) continue;  // a net of points has nothing to turn
      const Row row = study(hand, mesh, field, exact, poses);
      const auto at = [&](double share) {
        return row.closed ? row.milliseconds[static_cast<std::size_t>(share * (row.closed - 1))] : 0;
      };
      std::printf("%s,%s,%d,%.3f,%.3f,%d,%d,%.3f,%.3f\n", name.c_str(), hand_name.c_str(), row.closed,
                  1e3 * row.deepest_m, 1e3 * row.on_the_way_m, row.limits, row.backwards, at(0.5), at(0.9));
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
