#include "stages/scan/cameras.h"

#include <algorithm>
#include <cmath>

#include "pipeline/error.h"

namespace geocage::stages {

using geometry::DepthCamera;
using geometry::Vec3;

namespace {

[[noreturn]] void refuse(const char* sentence, const char* hint) {
  throw pipeline::UserError(pipeline::Fault::configuration, "scan.positions_m", sentence, hint);
}

std::vector<Vec3> positions_of(const ScanParams& params, const Vec3& center, double diagonal_m) {
  std::vector<Vec3> positions;
  if (params.placement != "list") {
    const double distance =
        params.placement == "metres" ? params.distance_m : params.distance_diagonals * diagonal_m;
    for (int k = 0; k < params.views; ++k)
      positions.push_back(center + distance * geometry::lattice_direction(k, params.views));
    return positions;
  }
  const auto& numbers = params.positions_m;
  if (numbers.empty() || numbers.size() % 3 != 0)
    refuse("a list of positions needs three numbers for each", "say [x, y, z, x, y, z, ...]");
  for (std::size_t i = 0; i < numbers.size(); i += 3) {
    positions.emplace_back(numbers[i], numbers[i + 1], numbers[i + 2]);
    if ((positions.back() - center).norm() < 1e-6)
      refuse("a camera in the middle of the object has nowhere to look", "move it away");
  }
  return positions;
}

/// Focal lengths and middle of the image.
void set_intrinsics(DepthCamera& camera, const ScanParams& params, double distance_m, double diagonal_m) {
  camera.width = params.width;
  camera.height = params.height;
  camera.cx_px = params.width / 2.0;
  camera.cy_px = params.height / 2.0;
  if (params.intrinsics == "matrix") {
    camera.fx_px = params.fx_px;
    camera.fy_px = params.fy_px;
    camera.cx_px = params.cx_px;
    camera.cy_px = params.cy_px;
  } else if (params.intrinsics == "field_of_view") {
    camera.fx_px = camera.fy_px = params.width / 2.0 / std::tan(params.field_of_view_deg * M_PI / 360);
  } else {  // the ball of half a diagonal fills the shorter side; from inside the ball, a right angle
    const double half_tan = std::tan(std::asin(std::min(diagonal_m / 2 / distance_m, std::sqrt(0.5))));
    camera.fx_px = camera.fy_px = std::min(params.width, params.height) / (2 * half_tan);
  }
}

}  // namespace

std::vector<DepthCamera> cameras_of(const ScanParams& params, const Vec3& center, double diagonal_m) {
  std::vector<DepthCamera> cameras;
  for (const Vec3& p : positions_of(params, center, diagonal_m)) {
    DepthCamera& camera = cameras.emplace_back();
    camera.X_OS = geometry::look_at(p, center);
    set_intrinsics(camera, params, (p - center).norm(), diagonal_m);
  }
  return cameras;
}

}  // namespace geocage::stages
