#pragma once
#include <optional>
#include <vector>

#include "geometry/ray_scene.h"

struct RTCPointQueryFunctionArguments;

namespace geocage::geometry {

/// A mesh that tells distances and nearest points, in double whatever the search tree rounds, and insides.
/// Any triangles will do; `inside` wants a closed mesh. Questions may come from several threads.
class Surface {
 public:
  explicit Surface(const TriangleMesh& mesh);

  /// Unsigned distance of p. `nearest` comes in as any triangle, best one near p, and leaves as the nearest
  /// one. O(log F) when the triangle is near.
  double distance_m(const Vec3& p_O, unsigned& nearest) const;

  struct Foot {
    Vec3 point_O;
    double distance_m;
  };
  /// The nearest point of the surface; `nearest` as above.
  Foot foot(const Vec3& p_O, unsigned& nearest) const;
  /// The nearest point on triangles whose normal n has n . normal_O > least_cos, no farther than `within_m`:
  /// the same side of a thin wall. Nothing when there is none. `normal_O` is a unit vector.
  std::optional<Foot> foot_facing(const Vec3& p_O, const Vec3& normal_O, double least_cos, double within_m,
                                  unsigned& nearest) const;

  /// True when p is inside: a majority of fixed rays meets its first triangle from behind.
  bool inside(const Vec3& p_O) const;

  const Vec3& normal(unsigned triangle) const {
    return facets_[triangle].normal;
  }  ///< NaN where it has no area
  /// Weights of a triangle's corners at the foot of p on its plane; precondition: it has an area.
  Vec3 barycentric(const Vec3& p_O, unsigned triangle) const;

 private:
  /// A triangle made ready for many distances.
  struct Facet {
    Vec3 a, ab, ac;
    Vec3 normal, to_b, to_c;  ///< NaN for a triangle without area, which then counts as its sides
    Facet(const Vec3& corner_a, const Vec3& b, const Vec3& c);
    double distance2(const Vec3& p, double limit2) const;
    Vec3 nearest_point(const Vec3& p) const;
  };
  struct Query {
    const Surface* surface;
    Vec3 p;
    std::optional<Vec3> facing;
    double best2;
    std::optional<unsigned> nearest;
    double least_cos = 0;
  };
  Surface(const TriangleMesh& mesh, const MeshReport& report);
  void search(Query& query) const;
  float search_radius(double best2) const;
  static bool visit_triangle(RTCPointQueryFunctionArguments* arguments);

  const double slack_m_;
  std::vector<Facet> facets_;
  RayScene scene_;
};

}  // namespace geocage::geometry
