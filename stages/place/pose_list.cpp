#include "stages/place/pose_list.h"

#include <cmath>
#include <numbers>
#include <random>

#include <Eigen/Eigenvalues>

namespace geocage::stages {

using geometry::Vec3;
using topology::Candidate;

namespace {

constexpr double two_pi = 2 * std::numbers::pi;
constexpr double elongated = 2;  // ratio of the ball's two largest variances: what a ring suits

double uniform(std::mt19937_64& random) {
  return static_cast<double>(random() >> 11) * 0x1p-53;
}

template <class T>
const T& drawn(std::mt19937_64& random, const std::vector<T>& list) {
  return list[static_cast<std::size_t>(uniform(random) * static_cast<double>(list.size()))];
}

std::mt19937_64 random_of(const PlaceParams& params, const Candidate& candidate) {
  std::seed_seq seed{static_cast<std::uint32_t>(params.seed), static_cast<std::uint32_t>(params.seed >> 32),
                     static_cast<std::uint32_t>(candidate.vertex),
                     static_cast<std::uint32_t>(candidate.heuristic.size())};
  return std::mt19937_64(seed);
}

std::optional<Vec3> direction(const Candidate& candidate, const std::string& approach) {
  Vec3 along = -candidate.n_O;
  if (approach == "center") {
    along = candidate.center_O - candidate.p_O;
    along -= along.dot(candidate.axis_O) * candidate.axis_O;
  }
  if (along.norm() < 0.001) return std::nullopt;  // the centre lies on the surface
  return along.normalized();
}

/// The ball's axis, or any direction across the approach where there is none.
Vec3 flexion_axis(const PlaceParams& params, const Candidate& candidate, const Vec3& approach,
                  std::mt19937_64& random) {
  Vec3 flexion = candidate.axis_O - candidate.axis_O.dot(approach) * approach;
  if (flexion.norm() < 0.1) flexion = approach.unitOrthogonal();
  const double turn = params.align_plane ? 0 : two_pi * uniform(random);
  return Eigen::AngleAxisd(turn, approach) * flexion.normalized();
}

/// Whether the surface around the ball's centre is long: its vertices within the ball's radius.
bool is_elongated(const Candidate& candidate, const geometry::TriangleMesh& mesh) {
  Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
  for (const Vec3& p : mesh.vertices) {
    const Vec3 r = p - candidate.center_O;
    if ((p - candidate.p_O).norm() <= candidate.radius_m) squares += r * r.transpose();
  }
  const Vec3 values =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(squares, Eigen::EigenvaluesOnly).eigenvalues();
  return values[2] > elongated * values[1];
}

/// Fingers side by side for rings and long shapes, spread for round ones.
std::vector<double> spreads_of(const PlaceParams& params, const Candidate& candidate,
                               const geometry::TriangleMesh& mesh) {
  if (!params.spread_by_shape) return params.spreads_rad;
  return {candidate.heuristic == "winding" || is_elongated(candidate, mesh) ? 0.0 : 0.5};
}

}  // namespace

PoseList listed_poses(const PlaceParams& params, const Candidate& candidate,
                      const geometry::TriangleMesh& mesh, const std::vector<double>& gaps_m) {
  PoseList list;
  auto random = random_of(params, candidate);
  const bool ring = candidate.heuristic == "winding" || candidate.heuristic == "loops" ||
                    candidate.heuristic == "antipodal";
  const int rolls = ring ? params.rolls_winding : params.rolls_curvature;
  const std::vector<double> spreads = spreads_of(params, candidate, mesh);
  for (const std::string& approach : params.approaches) {
    const auto along = direction(candidate, approach);
    if (!along) {
      list.no_direction += rolls * static_cast<int>(gaps_m.size() * spreads.size());
      continue;
    }
    const Vec3 flexion = flexion_axis(params, candidate, *along, random);
    for (int roll = 0; roll < rolls; ++roll)
      for (double gap_m : gaps_m)
        for (double spread_rad : spreads)
          list.choices.push_back(
              {candidate.p_O, *along, flexion, two_pi * roll / rolls, gap_m, spread_rad, 0});
  }
  return list;
}

std::vector<PoseChoice> local_poses(const PlaceParams& params, const PoseList& listed,
                                    const Candidate& candidate, const std::vector<double>& gaps_m) {
  std::vector<PoseChoice> samples;
  if (listed.choices.empty()) return samples;
  auto random = random_of(params, candidate);
  const std::vector<int> steps = {-1, 0, 1};
  for (int i = 0; i < params.local_samples; ++i) {
    PoseChoice choice = drawn(random, listed.choices);
    const Vec3 sideways = choice.flexion_O.cross(choice.approach_O);
    const Vec3 moved = drawn(random, steps) * sideways + drawn(random, steps) * choice.flexion_O;
    choice.p_O += params.local_offset_m * moved;
    const int tilt = static_cast<int>(5 * uniform(random));  // not at all, or to one of four sides
    if (tilt > 0) {
      const Vec3 axis = (tilt % 2 ? 1 : -1) * (tilt < 3 ? sideways : choice.flexion_O);
      const Eigen::AngleAxisd turn(params.local_tilt_rad, axis);
      choice.approach_O = turn * choice.approach_O;
      choice.flexion_O = turn * choice.flexion_O;
    }
    choice.roll_rad = two_pi * static_cast<int>(params.local_rolls * uniform(random)) / params.local_rolls;
    choice.gap_m = drawn(random, gaps_m);
    choice.spread_rad = drawn(random, params.local_spreads_rad);
    choice.opened_rad = drawn(random, params.local_openings_rad);
    samples.push_back(choice);
  }
  return samples;
}

}  // namespace geocage::stages
