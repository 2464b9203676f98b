#pragma once
#include <vector>

#include "geometry/cloud.h"
#include "geometry/depth_camera.h"
#include "geometry/noise.h"
#include "geometry/ray_scene.h"
#include "stages/scan/scan.h"

namespace geocage::stages {

/// What the pixels of one view answer. Every model draws its numbers from the view's own stream.
struct Exposure {
  const ScanParams& params;
  const geometry::RayScene& scene;
  const geometry::DepthCamera& camera;
  geometry::RandomStream& random;
};

/// Where a pixel's ray ended, and the unit normal of the triangle that it met.
struct SeenPoint {
  geometry::Vec3 p_O, normal_O;
};

/// The surface itself.
std::vector<SeenPoint> clean_points(const Exposure& view);

/// What a structured-light sensor answers (README): biased, quantised, with holes and flying pixels.
std::vector<SeenPoint> kinect_points(const Exposure& view);

/// The points moved by Gaussian numbers of deviation `sigma_m`, in the direction `params.along`.
std::vector<geometry::Vec3> with_gaussian(const std::vector<SeenPoint>& points, const Exposure& view,
                                          double sigma_m);

/// Replaces each point with the probability `share` by one anywhere on its ray within the ball.
void add_outliers(std::vector<geometry::Vec3>& points, const geometry::Vec3& sensor, double share,
                  const geometry::Vec3& ball_center, double ball_radius_m, geometry::RandomStream& random);

/// Loses that share of the views (one is left), then that share of the points: those nearest to a random one.
void lose_parts(geometry::PointCloud& cloud, double views_share, double surface_share,
                geometry::RandomStream& random);

/// A rigid motion of the sensor: turned by a Gaussian rotation vector about itself, then moved. X_WrongTrue.
geometry::Pose pose_error(const geometry::Vec3& sensor, double sigma_m, double sigma_rad,
                          geometry::RandomStream& random);

}  // namespace geocage::stages
