#include "stages/place/antipodal.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "geometry/ray_scene.h"

namespace geocage::stages {

using geometry::Vec3;

namespace {

constexpr int draws = 400, sides = 8;
constexpr double apart_m = 0.015, lift_m = 1e-5;  // a ray starts that far inside

struct Pair {
  Vec3 p, q;
  int vertex;
  double com_offset_m;
};

/// Where the inward ray of the vertex leaves the object, if the surface there faces it.
std::optional<Vec3> opposite(const geometry::RayScene& scene, const Vec3& p, const Vec3& n) {
  const auto hit = scene.first_hit(p - lift_m * n, -n);
  if (!hit || !hit->from_behind) return std::nullopt;
  return p - (lift_m + hit->range_m) * n;
}

Vec3 normal_at(const geometry::TriangleMesh& mesh, const std::vector<Vec3>& normals, const Vec3& q) {
  std::size_t nearest = 0;
  for (std::size_t v = 0; v < normals.size(); ++v)
    if ((mesh.vertices[v] - q).squaredNorm() < (mesh.vertices[nearest] - q).squaredNorm()) nearest = v;
  return normals[nearest];
}

std::vector<Pair> opposed_pairs(const PlaceParams& params, const geometry::TriangleMesh& mesh,
                                double widest_m) {
  const auto normals = geometry::vertex_normals(mesh);
  const Vec3 center = geometry::mass_properties(mesh).center;
  const geometry::RayScene scene(mesh, center);
  const double least = std::cos(std::atan(params.friction_mu));
  std::mt19937_64 random(params.seed);
  std::vector<Pair> pairs;
  for (int i = 0; i < draws; ++i) {
    const auto v = static_cast<std::size_t>(static_cast<double>(random() >> 11) * 0x1p-53 *
                                            static_cast<double>(normals.size()));
    const auto q = opposite(scene, mesh.vertices[v], normals[v]);
    if (!q || (*q - mesh.vertices[v]).norm() > widest_m) continue;
    if (-normals[v].dot(normal_at(mesh, normals, *q)) < least) continue;
    pairs.push_back(
        {mesh.vertices[v], *q, static_cast<int>(v), ((mesh.vertices[v] + *q) / 2 - center).norm()});
  }
  std::stable_sort(pairs.begin(), pairs.end(),
                   [](const Pair& a, const Pair& b) { return a.com_offset_m < b.com_offset_m; });
  return pairs;
}

/// The hand comes along `approach`; `axis` is across both that and the line of the fingers.
topology::Candidate candidate_of(const Pair& pair, const topology::Scores& scores, double side_rad) {
  topology::Candidate candidate;
  const Vec3 along = (pair.q - pair.p).normalized();
  const Vec3 approach = Eigen::AngleAxisd(side_rad, along) * along.unitOrthogonal();
  candidate.vertex = pair.vertex;
  candidate.heuristic = "antipodal";
  candidate.score = 1 / (1 + pair.com_offset_m / apart_m);
  candidate.radius_m = scores.ball.radius_m;
  candidate.center_O = (pair.p + pair.q) / 2;
  candidate.p_O = candidate.center_O;
  candidate.n_O = -approach;
  candidate.axis_O = approach.cross(along);
  return candidate;
}

}  // namespace

std::vector<topology::Candidate> antipodal_candidates(const PlaceParams& params,
                                                      const topology::Scores& scores, double widest_m) {
  std::vector<topology::Candidate> candidates;
  std::vector<Vec3> taken;
  if (scores.mesh.triangles.empty()) return candidates;
  for (const Pair& pair : opposed_pairs(params, scores.mesh, widest_m)) {
    if (static_cast<int>(taken.size()) == params.antipodal_places) break;
    const Vec3 middle = (pair.p + pair.q) / 2;
    if (std::any_of(taken.begin(), taken.end(), [&](const Vec3& p) { return (p - middle).norm() < apart_m; }))
      continue;
    taken.push_back(middle);
    for (int side = 0; side < sides; ++side)
      candidates.push_back(candidate_of(pair, scores, 2 * std::numbers::pi * side / sides));
  }
  return candidates;
}

}  // namespace geocage::stages
