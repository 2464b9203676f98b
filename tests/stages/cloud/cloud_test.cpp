#include "stages/cloud/cloud.h"

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <iostream>

#include <Eigen/SVD>
#include <gtest/gtest.h>

#include "datasets/shapes.h"
#include "geometry/depth_camera.h"
#include "geometry/mesh_files.h"
#include "geometry/noise.h"
#include "pipeline/error.h"
#include "stages/cloud/register.h"
#include "stages/scan/scan.h"

namespace geocage::stages {
namespace {

using geometry::PointCloud;
using geometry::Vec3;

/// What two far sensors see of a ball of 50 mm, each its half; or all of it without sensors.
PointCloud ball(bool sensors) {
  PointCloud cloud;
  cloud.points = datasets::icosphere(0.05, 5).vertices;
  if (!sensors) return cloud;
  // From 5 m a point is seen when |x| > r^2 / 5 m = 0.5 mm.
  std::erase_if(cloud.points, [](const Vec3& p) { return std::abs(p.x()) < 0.001; });
  cloud.sensor_origins = {{5, 0, 0}, {-5, 0, 0}};
  for (const Vec3& p : cloud.points) cloud.view.push_back(p.x() < 0);
  return cloud;
}

// 24 neighbours span about 6 mm of a ball of 50 mm: a plane fits to an angle of 3/50 at most at the border of
// a view.
TEST(Cloud, NormalsPointOutward) {
  for (bool sensors : {true, false}) {
    pipeline::Run run;
    const auto clean = cloud({}, run, ball(sensors));
    ASSERT_EQ(clean.normals.size(), clean.size());
    for (std::size_t i = 0; i < clean.size(); ++i) {
      EXPECT_NEAR(clean.normals[i].norm(), 1, 1e-6);
      EXPECT_GT(clean.normals[i].dot(clean.points[i].normalized()), 0.99);
    }
    EXPECT_EQ(run.metrics().at("oriented_by_sensor"), sensors);
  }
}

TEST(Cloud, OutliersGoAndEveryPointIsAccountedFor) {
  auto raw = ball(false);
  const std::size_t good = raw.size();
  for (int i = 0; i < 20; ++i)
    raw.points.emplace_back(0.1 + 0.02 * i, 0.1 * std::sin(i), 0.1 * std::cos(2 * i));
  pipeline::Run run;
  const auto clean = cloud({}, run, raw);
  const auto& m = run.metrics();
  EXPECT_GE(m.at("outliers"), 20);
  EXPECT_LT(m.at("outliers"), 20 + 0.02 * static_cast<double>(good));
  EXPECT_EQ(m.at("points_in"), m.at("outliers") + m.at("thinned") + m.at("points"));
  for (const Vec3& p : clean.points) EXPECT_LT(p.norm(), 0.06);
}

TEST(Cloud, ThinsToTheVoxelAndKeepsViewsAndSupport) {
  auto raw = ball(true);
  raw.support = geometry::Plane{Vec3::UnitZ(), -0.05};
  pipeline::Run run;
  const auto coarse = cloud({.voxel_m = 0.008}, run, raw), fine = cloud({.voxel_m = 0.004}, run, raw);
  // Area over voxel area: a fourth of the points, loosely because voxels cut the surface at all angles.
  EXPECT_NEAR(static_cast<double>(fine.size()) / static_cast<double>(coarse.size()), 4, 0.8);
  EXPECT_EQ(fine.view.size(), fine.size());
  EXPECT_TRUE(fine.support);
  EXPECT_EQ(fine.sensor_origins, raw.sensor_origins);
}

/// A box of different sides with a knob at one corner, so that no turn maps it onto itself, as six far
/// sensors along the axes see it; 1 mm from point to point.
PointCloud knobbed_box() {
  PointCloud cloud;
  const auto put_box = [&](const Vec3& size, const Vec3& at) {
    for (int axis = 0; axis < 3; ++axis)
      for (int side : {-1, 1}) {
        const int u = (axis + 1) % 3, v = (axis + 2) % 3;
        for (double x = -size[u] / 2 + 3e-4; x < size[u] / 2; x += 1e-3)
          for (double y = -size[v] / 2 + 4e-4; y < size[v] / 2; y += 1e-3) {
            Vec3 p = at;
            p[axis] += side * size[axis] / 2;
            p[u] += x;
            p[v] += y;
            cloud.points.push_back(p);
            cloud.view.push_back(2 * axis + (side > 0));
          }
      }
  };
  put_box({0.09, 0.06, 0.035}, Vec3::Zero());
  put_box({0.02, 0.02, 0.02}, {0.03, 0.015, 0.0275});
  for (int axis = 0; axis < 3; ++axis)
    for (int side : {-1, 1}) cloud.sensor_origins.push_back(side * 2.0 * Vec3::Unit(axis));
  return cloud;
}

geometry::RandomStream random_stream(std::uint64_t stream) {
  return {11, stream};
}

/// The same points with noise, so that no two have the same distance to a third.
PointCloud noisy(PointCloud cloud, double sigma_m) {
  auto random = random_stream(0);
  for (Vec3& p : cloud.points) p += sigma_m * random.normal_vector();
  return cloud;
}

PointCloud moved(const geometry::Pose& X, PointCloud cloud) {
  for (Vec3& p : cloud.points) p = X * p;
  for (Vec3& p : cloud.sensor_origins) p = X * p;
  return cloud;
}

/// Share of the points of a that have a point of b within `reach_m`, facing alike.
double share_near(const PointCloud& a, const PointCloud& b, double reach_m) {
  std::size_t near = 0;
  for (std::size_t i = 0; i < a.size(); ++i)
    for (std::size_t j = 0; j < b.size(); ++j)
      if ((a.points[i] - b.points[j]).norm() < reach_m && a.normals[i].dot(b.normals[j]) > 1 - 1e-4) {
        ++near;
        break;
      }
  return static_cast<double>(near) / static_cast<double>(a.size());
}

// PCL works in single precision: neighbours at equal distances within 1e-8 m, and mean distances at the
// limit, may fall either way. At most one point in 200 may change by it; all others stay to 1e-7 m.
TEST(Cloud, PermutingAndTurningChangeNothingButRounding) {
  const auto raw = noisy(knobbed_box(), 2e-4);
  const CloudParams params{.voxel_m = 0.003};
  pipeline::Run run;
  const auto plain = cloud(params, run, raw);
  std::vector<int> order;
  for (std::size_t i = 0; i < raw.size(); ++i) order.push_back(static_cast<int>((i * 7919) % raw.size()));
  const auto permuted = cloud(params, run, geometry::subset(raw, order));
  EXPECT_NEAR(static_cast<double>(permuted.size()), static_cast<double>(plain.size()),
              0.005 * static_cast<double>(plain.size()));
  EXPECT_GT(share_near(plain, permuted, 1e-7), 0.995);
  geometry::Pose X = geometry::Pose::Identity();
  X.translate(Vec3(0.3, -0.2, 0.5)).rotate(Eigen::AngleAxisd(0.8, Vec3(3, 1, 2).normalized()));
  const auto turned = moved(X.inverse(), cloud(params, run, moved(X, raw)));
  EXPECT_NEAR(static_cast<double>(turned.size()), static_cast<double>(plain.size()),
              0.005 * static_cast<double>(plain.size()));
  auto back = turned;
  for (Vec3& n : back.normals) n = X.linear().transpose() * n;
  EXPECT_GT(share_near(plain, back, 1e-7), 0.995);
}

// The cleaned cloud moves no more than the noise does.
TEST(Cloud, WithNoNoiseLeftItIsTheCleanResult) {
  const auto raw = knobbed_box();
  pipeline::Run run;
  const CloudParams params{.outlier_sigmas = 100};
  const auto clean = cloud(params, run, raw);
  for (double sigma : {1e-5, 1e-7}) {
    const auto near = cloud(params, run, noisy(raw, sigma));
    for (std::size_t i = 0; i < near.size(); i += 7) {
      double best = 1;  // distance to the true surface: of the two boxes
      for (const Vec3& q : raw.points) best = std::min(best, (near.points[i] - q).norm());
      EXPECT_LT(best, 1.5e-3 + 5 * sigma);
    }
    EXPECT_NEAR(static_cast<double>(near.size()), static_cast<double>(clean.size()),
                0.02 * static_cast<double>(clean.size()));
  }
}

// On a sphere a local surface of second order averages some 80 points within 8 mm (1 a 2.4 mm^2): a residual
// of sigma sqrt(6 / 80) is what least squares leaves, a third of sigma with room for its bias.
TEST(Cloud, MovingLeastSquaresTakesNoiseAway) {
  auto raw = ball(false);
  auto random = random_stream(2);
  for (Vec3& p : raw.points) p += 5e-4 * random.normal() * p.normalized();
  const auto rms = [](const PointCloud& c) {
    double sum = 0;
    for (const Vec3& p : c.points) sum += std::pow(p.norm() - 0.05, 2);
    return std::sqrt(sum / static_cast<double>(c.size()));
  };
  pipeline::Run run;
  const auto smooth = cloud({.voxel_m = 1e-4, .smooth = "mls"}, run, raw);
  EXPECT_LT(rms(smooth), 2.2e-4);
  const auto& m = run.metrics();
  EXPECT_EQ(m.at("points_in"),
            m.at("outliers") + m.at("lonely") + m.at("thinned") + m.at("grazing") + m.at("points"));
}

// A curtain of points between an edge and what lies behind it runs along the rays that saw it.
TEST(Cloud, PointsAlongTheirRaysAreDropped) {
  PointCloud raw;
  raw.sensor_origins = {{0, 0, 1}};
  for (int x = -50; x <= 50; ++x)
    for (int y = -50; y <= 50; ++y) raw.points.emplace_back(0.001 * x, 0.001 * y, 0);
  const std::size_t good = raw.size();
  for (int z = 12; z < 60; ++z)
    for (int y = -50; y <= 50; ++y) raw.points.emplace_back(0.05 - 0.00005 * z, 0.001 * y, -0.001 * z);
  raw.view.assign(raw.size(), 0);
  pipeline::Run run;
  const auto clean = cloud({.outlier_sigmas = 100, .voxel_m = 2e-4, .grazing_deg = 80}, run, raw);
  for (const Vec3& p : clean.points) EXPECT_GT(p.z(), -0.012 - 1e-6);
  EXPECT_GT(clean.size(), good * 95 / 100);
  EXPECT_GT(run.metrics().at("grazing"), 4000);
}

/// Rotation and shift that a view still has against the truth, relative to the first view's.
std::pair<double, double> pose_error(const PointCloud& found, const PointCloud& truth, int view) {
  Eigen::Matrix3Xd a(3, truth.size()), b(3, truth.size());
  int n = 0;
  for (std::size_t i = 0; i < truth.size(); ++i)
    if (truth.view[i] == view) {
      a.col(n) = found.points[i];
      b.col(n++) = truth.points[i];
    }
  const Eigen::Matrix4d X = Eigen::umeyama(a.leftCols(n), b.leftCols(n), false);
  const Vec3 middle = a.leftCols(n).rowwise().mean();
  const Eigen::AngleAxisd turn(Eigen::Matrix3d(X.topLeftCorner<3, 3>()));
  return {(X.topLeftCorner<3, 3>() * middle + X.topRightCorner<3, 1>() - middle).norm(), turn.angle()};
}

/// How far the points of a view lie from where they belong.
double mean_distance_m(const PointCloud& found, const PointCloud& truth, int view) {
  double sum = 0;
  int count = 0;
  for (std::size_t i = 0; i < truth.size(); ++i)
    if (truth.view[i] == view) {
      sum += (found.points[i] - truth.points[i]).norm();
      ++count;
    }
  return sum / std::max(1, count);
}

// Eight views of an ellipsoid with three different axes, each of the side that faces it: only all together
// hold each other. 5 mm of error go down to a tenth. 1.5 degrees go down to a quarter: points lie 3 mm apart
// and normals are fitted to 24 of them, which cuts curved borders of a view short on one side.
TEST(Cloud, RegistrationPutsViewsWhereTheyBelong) {
  constexpr int views = 8;
  const Vec3 axes(0.05, 0.035, 0.022);
  PointCloud truth;
  for (int k = 0; k < views; ++k) {
    truth.sensor_origins.push_back(geometry::lattice_direction(k, views));
    for (const Vec3& p : datasets::icosphere(1, 4).vertices)
      if (p.cwiseQuotient(axes).normalized().dot(truth.sensor_origins.back()) > 0.1) {
        truth.points.push_back(p.cwiseProduct(axes));
        truth.view.push_back(k);
      }
  }
  auto random = random_stream(4);
  for (Vec3& p : truth.points) p += 2e-4 * random.normal_vector();
  auto wrong = truth;
  std::vector<geometry::Pose> error(views, geometry::Pose::Identity());
  for (int k = 1; k < views; ++k)
    error[k].translate(0.005 * random.direction()).rotate(Eigen::AngleAxisd(0.026, random.direction()));
  for (std::size_t i = 0; i < wrong.size(); ++i) wrong.points[i] = error[wrong.view[i]] * wrong.points[i];
  for (int k = 0; k < views; ++k) wrong.sensor_origins[k] = error[k] * wrong.sensor_origins[k];
  auto found = wrong;
  const auto done = register_views(found, 0.02, 15);
  EXPECT_LT(done.rms_after_m, done.rms_before_m);
  for (int k = 1; k < views; ++k) {
    EXPECT_LT(pose_error(found, truth, k).first, 5e-4) << k;
    EXPECT_LT(pose_error(found, truth, k).second, 6.5e-3) << k;
    EXPECT_LT((found.sensor_origins[k] - truth.sensor_origins[k]).norm(), 0.01) << k;
  }
}

// Eight views of a real shape, moved by 5 mm and turned by 1.2 degrees (deviation a direction) about sensors
// 0.8 m away. The Kinect's own warp, 2 mm, pulls ICP away from the truth, so errors of millimetres stay.
void register_scanned(const std::string& name, bool kinect) {
  const char* folder = std::getenv("GEOCAGE_TEST_OBJECTS");
  if (!folder) GTEST_SKIP() << "GEOCAGE_TEST_OBJECTS is not set";
  constexpr int views = 8;
  const auto mesh = geometry::read_mesh(std::filesystem::path(folder) / (name + ".stl"));
  ScanParams params{.views = views, .placement = "metres", .width = 160, .height = 120};
  params.sigma_m = 0.0005;
  params.noise = {kinect ? "kinect" : "gaussian"};
  pipeline::Run run;
  const auto truth = scan(params, run, mesh);
  params.pose_error_m = 0.005;
  params.pose_error_rad = 0.02;
  const auto wrong = scan(params, run, mesh);  // the same points, view by view
  auto found = wrong;
  const auto done = register_views(found, 0.02, 15);
  std::vector<double> before, after;
  for (int k = 1; k < views; ++k) {
    before.push_back(mean_distance_m(wrong, truth, k));
    after.push_back(mean_distance_m(found, truth, k));
  }
  std::sort(before.begin(), before.end());
  std::sort(after.begin(), after.end());
  std::cout << name << (kinect ? " kinect" : " gaussian")
            << ": points of a view off by [mm], median and most: " << 1e3 * before[views / 2] << ", "
            << 1e3 * before.back() << " -> " << 1e3 * after[views / 2] << ", " << 1e3 * after.back()
            << "; rms to the planes " << 1e3 * done.rms_before_m << " -> " << 1e3 * done.rms_after_m << "\n";
  EXPECT_LT(after.back(), (kinect ? 0.5 : 0.05) * before.back()) << name;
}

TEST(Cloud, RegistrationOfAScannedObject) {
  register_scanned("bunny", false);
}

// The table of docs/measurements/sensing.md: cloud_test --gtest_also_run_disabled_tests --gtest_filter=*Study
TEST(Cloud, DISABLED_RegistrationStudy) {
  for (const char* name : {"bunny", "duck", "hammer"})
    for (const bool kinect : {false, true}) register_scanned(name, kinect);
}

TEST(Cloud, TooFewPointsAreRefused) {
  pipeline::Run run;
  EXPECT_THROW(cloud({.voxel_m = 0.05}, run, ball(false)), pipeline::UserError);
}

}  // namespace
}  // namespace geocage::stages
