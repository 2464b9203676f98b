#pragma once
#include <optional>

#include "geometry/mesh.h"

struct RTCDeviceTy;
struct RTCSceneTy;

namespace geocage::geometry {

/// A mesh in Embree, moved so that `center_O` is its origin: Embree's boxes and rays are in single precision.
/// Rays may be cast from several threads.
class RayScene {
 public:
  RayScene(const TriangleMesh& mesh, const Vec3& center_O);
  ~RayScene();
  RayScene(const RayScene&) = delete;
  RayScene& operator=(const RayScene&) = delete;

  struct Hit {
    double range_m;    ///< along a unit direction
    bool from_behind;  ///< the triangle faces away
    int triangle;
    Vec3 normal_O;  ///< of the triangle, unit
  };
  /// The first triangle that the ray meets; nothing when there is none.
  std::optional<Hit> first_hit(const Vec3& from_O, const Vec3& along_O) const;

  const Vec3& center() const { return center_; }
  RTCSceneTy* handle() const { return scene_; }

 private:
  Vec3 center_;
  RTCDeviceTy* device_;
  RTCSceneTy* scene_;
};

}  // namespace geocage::geometry
