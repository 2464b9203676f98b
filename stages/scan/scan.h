#pragma once
#include "geometry/cloud.h"
#include "geometry/mesh.h"
#include "pipeline/stage.h"

namespace geocage::stages {

struct ScanParams {
  int views = 6;
  int width = 240;
  int height = 240;
  double distance_diagonals = 2.5;
  double sigma_m = 0.001;
  std::string noise = "ray";
  std::uint64_t seed = 1;
  void visit(pipeline::Fields& f);
};

/// What a depth camera sees of a mesh from several views on a sphere around it: one point a pixel that meets
/// the surface, its view, and where each view's sensor stood. Same seed, same bytes, for any number of
/// threads. Errors: UserError (geometry) when no ray meets the surface.
geometry::PointCloud scan(const ScanParams& params, pipeline::Run& run, const geometry::TriangleMesh& mesh);

inline constexpr pipeline::Stage scan_stage{"scan", 1, &scan};

}  // namespace geocage::stages
