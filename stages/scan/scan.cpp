#include "stages/scan/scan.h"

#include <algorithm>

#include "pipeline/error.h"
#include "stages/scan/cameras.h"
#include "stages/scan/noise_models.h"

namespace geocage::stages {

using geometry::PointCloud;
using geometry::RandomStream;
using geometry::TriangleMesh;
using geometry::Vec3;

void ScanParams::visit(pipeline::Fields& f) {
  f("views", views, {1, 1000}, "views, spread evenly over a sphere around the object")
      .only_with("placement", {"diagonals", "metres"});
  f("placement", placement, {"diagonals", "metres", "list"},
    "how far cameras stand: in diagonals of the object's box, in metres, or where positions_m says");
  f("distance_diagonals", distance_diagonals, {0.6, 100},
    "distance of the sensor from the centre, in diagonals of the object's box")
      .only_with("placement", {"diagonals"});
  f("distance_m", distance_m, {0.01, 100}, "distance of the sensor from the centre")
      .only_with("placement", {"metres"});
  f("positions_m", positions_m, {-100, 100}, "x, y, z of each camera in O; it looks at the centre")
      .only_with("placement", {"list"});
  f("width", width, {8, 4096}, "pixels of a row");
  f("height", height, {8, 4096}, "pixels of a column");
  f("intrinsics", intrinsics, {"fit", "field_of_view", "matrix"},
    "focal length: the object fills the image, from field_of_view_deg, or fx_px to cy_px");
  f("field_of_view_deg", field_of_view_deg, {1, 170}, "horizontal")
      .only_with("intrinsics", {"field_of_view"});
  f("fx_px", fx_px, {1, 1e5}, "focal length along a row").only_with("intrinsics", {"matrix"});
  f("fy_px", fy_px, {1, 1e5}, "focal length along a column").only_with("intrinsics", {"matrix"});
  f("cx_px", cx_px, {-1e5, 1e5}, "principal point, from the image's left border")
      .only_with("intrinsics", {"matrix"});
  f("cy_px", cy_px, {-1e5, 1e5}, "principal point, from the image's upper border")
      .only_with("intrinsics", {"matrix"});
  f("range_min_m", range_min_m, {0, 100}, "nearer points are not seen");
  f("range_max_m", range_max_m, {0, 100}, "farther points are not seen");
  f("noise", noise, {"gaussian", "kinect", "outliers", "missing"}, "the models at work; [] is a clean scan");
  f("along", along, {"ray", "normal", "isotropic"}, "in which direction").only_with("noise", {"gaussian"});
  f("sigma_m", sigma_m, {0, 0.1}, "deviation is the sum of this,").only_with("noise", {"gaussian"});
  f("sigma_edges", sigma_edges, {0, 10}, "of this many mean edges of the mesh,")
      .only_with("noise", {"gaussian"});
  f("sigma_diagonals", sigma_diagonals, {0, 1}, "and of this many diagonals of its box")
      .only_with("noise", {"gaussian"});
  f("axial_1pm", axial_1pm, {0, 1}, "deviation of the inverse depth").only_with("noise", {"kinect"});
  f("step_1pm", step_1pm, {0, 1}, "step of the inverse depth").only_with("noise", {"kinect"});
  f("bias_1pm", bias_1pm, {0, 1}, "root mean square of the smooth error of the inverse depth")
      .only_with("noise", {"kinect"});
  f("lateral_rad", lateral_rad, {0, 0.1}, "deviation of a pixel's direction, right and down")
      .only_with("noise", {"kinect"});
  f("warp_rad", warp_rad, {0, 0.1}, "root mean square of its smooth error, right and down")
      .only_with("noise", {"kinect"});
  f("window_width_rad", window_width_rad, {0, 0.5}, "what one disparity is measured of, along a row")
      .only_with("noise", {"kinect"});
  f("window_height_rad", window_height_rad, {0, 0.5}, "and along a column").only_with("noise", {"kinect"});
  f("baseline_m", baseline_m, {0, 1}, "from camera to projector, whose shadows have no depth")
      .only_with("noise", {"kinect"});
  f("dropout_share", dropout_share, {0, 1}, "pixels without depth anywhere").only_with("noise", {"kinect"});
  f("grazing_deg", grazing_deg, {0, 89.9}, "from this angle of incidence up to 90, more and more")
      .only_with("noise", {"kinect"});
  f("flying_share", flying_share, {0, 1}, "pixels at silhouettes that fly behind them")
      .only_with("noise", {"kinect"});
  f("flying_m", flying_m, {0, 1}, "how far they fly").only_with("noise", {"kinect"});
  f("outlier_share", outlier_share, {0, 1}, "points that lie anywhere on their rays")
      .only_with("noise", {"outliers"});
  f("missing_views", missing_views, {0, 1}, "share of the views").only_with("noise", {"missing"});
  f("missing_surface", missing_surface, {0, 0.99}, "share of the points, in one hole")
      .only_with("noise", {"missing"});
  f("pose_error_m", pose_error_m, {0, 1}, "deviation of a sensor's place, all views but the first");
  f("pose_error_rad", pose_error_rad, {0, 1}, "deviation of its rotation vector, all views but the first");
  f("seed", seed, "of all noise");
}

namespace {

bool has(const ScanParams& params, const char* model) {
  return std::count(params.noise.begin(), params.noise.end(), model) > 0;
}

/// Streams of random numbers: a view's pixels, its other troubles, and the whole scan.
constexpr std::uint64_t trouble_streams = 1u << 16, scan_stream = 1u << 18;

class Scanner {
 public:
  Scanner(const ScanParams& params, const TriangleMesh& mesh) : params_(params) {
    const auto report = geometry::check_mesh(mesh);
    center_ = (report.box_min + report.box_max) / 2;
    diagonal_m_ = report.diagonal_m();
    sigma_m_ = has(params, "gaussian") ? params.sigma_m + params.sigma_edges * report.mean_edge_m +
                                             params.sigma_diagonals * diagonal_m_
                                       : 0;
    cameras_ = cameras_of(params, center_, diagonal_m_);
  }
  double sigma_m() const { return sigma_m_; }
  const std::vector<geometry::DepthCamera>& cameras() const { return cameras_; }
  const Vec3& center() const { return center_; }

  PointCloud cloud(const geometry::RayScene& scene) const {
    std::vector<std::vector<Vec3>> seen(cameras_.size());
    std::vector<Vec3> sensors(cameras_.size());
#pragma omp parallel for schedule(dynamic, 1)
    for (std::size_t k = 0; k < cameras_.size(); ++k) {
      seen[k] = see(scene, k);
      sensors[k] = cameras_[k].p_OS();
      misplace(seen[k], sensors[k], k);
    }
    PointCloud cloud;
    for (std::size_t k = 0; k < cameras_.size(); ++k) {
      cloud.sensor_origins.push_back(sensors[k]);
      cloud.points.insert(cloud.points.end(), seen[k].begin(), seen[k].end());
      cloud.view.insert(cloud.view.end(), seen[k].size(), static_cast<int>(k));
    }
    if (has(params_, "missing")) {
      RandomStream random(params_.seed, scan_stream);
      lose_parts(cloud, params_.missing_views, params_.missing_surface, random);
    }
    return cloud;
  }

 private:
  std::vector<Vec3> see(const geometry::RayScene& scene, std::size_t k) const {
    RandomStream random(params_.seed, k);
    const Exposure view{params_, scene, cameras_[k], random};
    auto points =
        with_gaussian(has(params_, "kinect") ? kinect_points(view) : clean_points(view), view, sigma_m_);
    if (has(params_, "outliers"))
      add_outliers(points, cameras_[k].p_OS(), params_.outlier_share, center_, diagonal_m_, random);
    return points;
  }

  void misplace(std::vector<Vec3>& points, Vec3& sensor, std::size_t k) const {
    if (k == 0 || (params_.pose_error_m == 0 && params_.pose_error_rad == 0)) return;
    RandomStream random(params_.seed, trouble_streams + k);
    const auto error = pose_error(sensor, params_.pose_error_m, params_.pose_error_rad, random);
    for (Vec3& p : points) p = error * p;
    sensor = error * sensor;
  }

  const ScanParams& params_;
  Vec3 center_;
  double diagonal_m_ = 0, sigma_m_ = 0;
  std::vector<geometry::DepthCamera> cameras_;
};

}  // namespace

PointCloud scan(const ScanParams& params, pipeline::Run& run, const TriangleMesh& mesh) {
  const Scanner scanner(params, mesh);
  const geometry::RayScene scene(mesh, scanner.center());
  PointCloud cloud = scanner.cloud(scene);
  if (cloud.points.empty())
    throw pipeline::UserError(pipeline::Fault::geometry, "scan", "no ray meets the surface",
                              "is the mesh empty, far too thin, or out of scan.range_min_m, range_max_m?");
  run.metric("points", static_cast<double>(cloud.size()));
  run.metric("sensor_distance_m", (scanner.cameras().front().p_OS() - scanner.center()).norm());
  run.metric("sigma_m", scanner.sigma_m());
  return cloud;
}

}  // namespace geocage::stages
