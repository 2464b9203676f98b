#include "geometry/ray_scene.h"

#include <limits>

#include <embree3/rtcore.h>

namespace geocage::geometry {

namespace {

/// Wider vectors round otherwise: machines that have AVX-512 answer as those that don't.
constexpr const char* embree_config = "threads=1,set_affinity=0,max_isa=avx2";

}  // namespace

RayScene::RayScene(const TriangleMesh& mesh, const Vec3& center_O)
    : center_(center_O), device_(rtcNewDevice(embree_config)), scene_(rtcNewScene(device_)) {
  RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* vertices = static_cast<float*>(rtcSetNewGeometryBuffer(
      geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), mesh.vertices.size()));
  for (const Vec3& p : mesh.vertices)
    for (int i = 0; i < 3; ++i) *vertices++ = static_cast<float>(p[i] - center_[i]);
  auto* indices = static_cast<unsigned*>(rtcSetNewGeometryBuffer(
      geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(unsigned), mesh.triangles.size()));
  for (const auto& t : mesh.triangles)
    for (int v : t) *indices++ = static_cast<unsigned>(v);
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(scene_, geometry);
  rtcReleaseGeometry(geometry);
  rtcSetSceneFlags(scene_, RTC_SCENE_FLAG_ROBUST);
  rtcSetSceneBuildQuality(scene_, RTC_BUILD_QUALITY_HIGH);
  rtcCommitScene(scene_);
}

RayScene::~RayScene() {
  rtcReleaseScene(scene_);
  rtcReleaseDevice(device_);
}

std::optional<RayScene::Hit> RayScene::first_hit(const Vec3& from_O, const Vec3& along_O) const {
  const Eigen::Vector3f from = (from_O - center_).cast<float>(), along = along_O.cast<float>();
  RTCRayHit ray{};
  ray.ray.org_x = from.x();
  ray.ray.org_y = from.y();
  ray.ray.org_z = from.z();
  ray.ray.dir_x = along.x();
  ray.ray.dir_y = along.y();
  ray.ray.dir_z = along.z();
  ray.ray.tfar = std::numeric_limits<float>::infinity();
  ray.ray.mask = ~0u;
  ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcIntersect1(scene_, &context, &ray);
  if (ray.hit.geomID == RTC_INVALID_GEOMETRY_ID) return {};
  const Eigen::Vector3f normal(ray.hit.Ng_x, ray.hit.Ng_y, ray.hit.Ng_z);
  return Hit{ray.ray.tfar, normal.dot(along) > 0, static_cast<int>(ray.hit.primID),
             normal.cast<double>().normalized()};
}

}  // namespace geocage::geometry
