#pragma once
#include "geometry/cloud.h"
#include "geometry/mesh.h"
#include "pipeline/stage.h"

namespace geocage::stages {

struct ScanParams {
  // cameras
  int views = 6;
  std::string placement = "diagonals";
  double distance_diagonals = 2.5;
  double distance_m = 0.8;
  std::vector<double> positions_m;
  int width = 240;
  int height = 240;
  std::string intrinsics = "fit";
  double field_of_view_deg = 57;
  double fx_px = 525;
  double fy_px = 525;
  double cx_px = 320;
  double cy_px = 240;
  double range_min_m = 0;
  double range_max_m = 100;
  // noise
  std::vector<std::string> noise = {"gaussian"};
  std::string along = "ray";
  double sigma_m = 0.001;
  double sigma_edges = 0;
  double sigma_diagonals = 0;
  double axial_1pm = 0.0013;
  double step_1pm = 0.00287;
  double bias_1pm = 0.0027;
  double lateral_rad = 0.00125;
  double warp_rad = 0.0023;
  double window_width_rad = 0.0152;
  double window_height_rad = 0.0076;
  double baseline_m = 0.075;
  double dropout_share = 0.01;
  double grazing_deg = 75;
  double flying_share = 0.5;
  double flying_m = 0.02;
  double outlier_share = 0.02;
  double missing_views = 0;
  double missing_surface = 0.2;
  double pose_error_m = 0;
  double pose_error_rad = 0;
  std::uint64_t seed = 1;
  void visit(pipeline::Fields& f);
};

/// What a depth camera sees of a mesh from several views: one point a pixel that meets the surface, its view,
/// and where each view's sensor stood (as far as it knows: `pose_error_*` moves every view but the first).
/// Same seed, same bytes, for any number of threads; with all deviations 0 the points are those of the clean
/// scan. Errors: UserError (configuration) for positions that are no triples or lie in the object's centre,
/// UserError (geometry) when no ray meets the surface in range.
geometry::PointCloud scan(const ScanParams& params, pipeline::Run& run, const geometry::TriangleMesh& mesh);

inline constexpr pipeline::Stage scan_stage{"scan", 4, &scan};

}  // namespace geocage::stages
