#pragma once
#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "geometry/mesh.h"
#include "geometry/ray_scene.h"

struct RTCPointQueryFunctionArguments;

namespace geocage::geometry {

/// A triangle made ready for many distances; coordinates relative to a centre.
struct Facet {
  Vec3 a, ab, ac;
  Vec3 normal, to_b, to_c;  ///< NaN for a triangle without area, which then counts as its sides

  Facet(const Vec3& corner_a, const Vec3& b, const Vec3& c);
  /// Squared distance of p where it is less than `limit2`, else `limit2`.
  double distance2(const Vec3& p, double limit2) const;
  Vec3 nearest_point(const Vec3& p) const;
};

/// Distances to the triangles of a mesh, in double: Embree's boxes, which are in single precision, only say
/// which triangles to measure. Precondition: at least one triangle, valid indices, finite vertices. Queries
/// may run in several threads; O(log F) each.
class SurfaceDistance {
 public:
  explicit SurfaceDistance(const TriangleMesh& mesh);

  /// Unsigned distance of p. `nearest` comes in as any triangle, best one near p, and leaves as the nearest.
  double distance_m(const Vec3& p_O, int& nearest) const;

  /// The same where it is less than `limit_m`, else `limit_m`.
  double distance_within(const Vec3& p_O, double limit_m) const;

  struct Foot {
    Vec3 point_O;
    double distance_m;
  };
  /// The nearest point of the surface; `nearest` as above.
  Foot foot(const Vec3& p_O, int& nearest) const;
  /// The nearest point on triangles whose normal n has n . normal_O > least_cos, no farther than `within_m`:
  /// the same side of a thin wall. Nothing when there is none. `normal_O` is a unit vector.
  std::optional<Foot> foot_facing(const Vec3& p_O, const Vec3& normal_O, double least_cos, double within_m,
                                  int& nearest) const;

  /// The point of one triangle nearest to p.
  Vec3 nearest_point(const Vec3& p_O, int triangle) const {
    return facets_[triangle].nearest_point(p_O - center_) + center_;
  }
  const Vec3& normal(int triangle) const { return facets_[triangle].normal; }  ///< NaN where it has no area
  /// Weights of a triangle's corners at the foot of p on its plane; precondition: it has an area.
  Vec3 barycentric(const Vec3& p_O, int triangle) const;

  /// True when p is inside the closed mesh: a majority of fixed rays meets its first triangle from behind.
  bool inside(const Vec3& p_O) const;

 private:
  struct Query;
  struct Box {
    Vec3 center;
    double diagonal_m;
  };
  SurfaceDistance(const TriangleMesh& mesh, const Box& box);
  static Box box_of(const TriangleMesh& mesh);
  void search(Query& query) const;
  float search_radius(double best2) const;
  static bool visit_triangle(RTCPointQueryFunctionArguments* arguments);

  Vec3 center_;
  double slack_m_;
  std::vector<Facet> facets_;
  RayScene scene_;
};

/// Calls `take(centre, area)` for the parts of a triangle: n x n alike ones, whose centres are at most 2/3 of
/// their longest side away from any of their points (a median is no longer than the longest side, and the
/// centre is at two thirds of it), so that no point of the triangle is farther than `spacing_m` from one.
template <class Take>
void for_samples(const TriangleMesh& mesh, int triangle, double spacing_m, Take take) {
  const auto& t = mesh.triangles[triangle];
  const Vec3 &a = mesh.vertices[t[0]], ab = mesh.vertices[t[1]] - a, ac = mesh.vertices[t[2]] - a;
  const double longest = std::sqrt(std::max({ab.squaredNorm(), ac.squaredNorm(), (ac - ab).squaredNorm()}));
  const int n = std::max(1, static_cast<int>(std::ceil(2 * longest / (3 * spacing_m))));
  const double part = ab.cross(ac).norm() / 2 / n / n;
  for (int i = 0; i < n; ++i)
    for (int j = 0; i + j < n; ++j)
      for (int upper = 0; upper < (i + j + 1 < n ? 2 : 1); ++upper) {
        const double shift = upper ? 2.0 / 3 : 1.0 / 3;
        take(Vec3(a + (i + shift) / n * ab + (j + shift) / n * ac), part);
      }
}

/// How far a surface lies from another one.
struct Deviation {
  double max_m = 0;      ///< of the samples; no point of the surface is farther than max_m + spacing_m
  double mean_m = 0;     ///< over the area
  double rms_m = 0;      ///< over the area
  double spacing_m = 0;  ///< every point of the surface is at most this far from a sample
  int farthest = 0;      ///< triangle of `from` that holds the farthest sample
};

/// Distances from samples of `from` (all corners, and centres of parts of triangles, so that none is farther
/// than `spacing_m` from the next) to `to`. One-sided: the Hausdorff distance is the larger of both ways.
/// Preconditions as SurfaceDistance. Same bytes for any number of threads. O(samples log F).
Deviation deviation(const TriangleMesh& from, const SurfaceDistance& to, double spacing_m);

}  // namespace geocage::geometry
