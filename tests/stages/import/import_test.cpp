#include "stages/import/import.h"

#include <cmath>
#include <cstdlib>
#include <fstream>

#include <gtest/gtest.h>

#include "datasets/shapes.h"
#include "geometry/mesh_files.h"
#include "pipeline/error.h"
#include "tests/pipeline/scratch_folder.h"

namespace geocage::stages {
namespace {

using geometry::Vec3;
using pipeline::Fault;
using pipeline::UserError;

class ImportTest : public testing::Test {
 protected:
  geometry::TriangleMesh mesh(const std::string& name, const ImportParams& params = {}) {
    return import_mesh(params, run_, {folder_ / name});
  }
  geometry::PointCloud cloud(const std::string& name, const ImportParams& params = {}) {
    return import_cloud(params, run_, {folder_ / name});
  }
  /// A table 0.6 x 0.6 m, tilted towards a sensor at the origin, with a ball and a smaller one on it; noise
  /// of 1 mm.
  void write_table() const {
    std::ofstream out(folder_ / "table.xyz");
    const Eigen::Matrix3d R = Eigen::AngleAxisd(2.4, Vec3::UnitX()).toRotationMatrix();
    const Vec3 middle(0, 0, 0.9);
    int i = 0;
    const auto put = [&](const Vec3& p) {
      const Vec3 q = middle + R * (p + 0.0005 * Vec3(0, 0, std::sin(12.9898 * ++i)));
      out << q.x() << " " << q.y() << " " << q.z() << "\n";
    };
    for (int x = -150; x <= 150; ++x)
      for (int y = -150; y <= 150; ++y) put({x * 0.002, y * 0.002, 0});
    for (const auto& [radius, at, n] :
         {std::tuple{0.05, Vec3(0.1, 0, 0.05), 5}, {0.03, Vec3(-0.1, 0.05, 0.03), 4}})
      for (const Vec3& p : datasets::icosphere(radius, n).vertices) put(p + at);
  }
  tests::ScratchFolder folder_;
  pipeline::Run run_;
};

TEST_F(ImportTest, EveryMeshFormatGivesTheSameClosedSurface) {
  const auto torus = datasets::torus(0.04, 0.015, 24, 12);
  geometry::write_ply(folder_ / "t.ply", torus);
  std::ofstream off(folder_ / "t.off"), obj(folder_ / "t.obj"), stl(folder_ / "t.stl");
  off << "OFF\n" << torus.vertices.size() << " " << torus.triangles.size() << " 0\n";
  stl << "solid t\n";
  for (const auto& p : torus.vertices) {
    off << p.transpose() << "\n";
    obj << "v " << p.transpose() << "\n";
  }
  for (const auto& t : torus.triangles) {
    off << "3 " << t[0] << " " << t[1] << " " << t[2] << "\n";
    obj << "f " << t[0] + 1 << " " << t[1] + 1 << " " << t[2] + 1 << "\n";
    stl << "facet normal 0 0 0\nouter loop\n";
    for (int v : t) stl << "vertex " << torus.vertices[v].transpose() << "\n";
    stl << "endloop\nendfacet\n";
  }
  stl << "endsolid t\n";
  for (auto* file : {&off, &obj, &stl}) file->close();
  const auto truth = check_mesh(torus);
  for (const char* name : {"t.ply", "t.off", "t.obj", "t.stl"}) {
    const auto report = check_mesh(mesh(name));
    EXPECT_TRUE(report.closed_manifold()) << name << ": " << flaw(report);
    EXPECT_EQ(report.euler, 0) << name;
    EXPECT_EQ(report.vertices, truth.vertices) << name;
    // Text of 6 digits and assimp's floats: 1e-6 relative a coordinate, a few times that in a volume.
    EXPECT_NEAR(report.volume_m3, truth.volume_m3, 2e-5 * truth.volume_m3) << name;
  }
}

TEST_F(ImportTest, UnitsAndTheGuard) {
  geometry::write_ply(folder_ / "mm.ply", datasets::icosphere(40, 2));
  try {
    mesh("mm.ply");
    FAIL();
  } catch (const UserError& error) {
    EXPECT_EQ(error.fault(), Fault::input);
    for (const char* factor : {"0.001", "0.01", "0.0254"})
      EXPECT_NE(error.hint().find(factor), std::string::npos) << factor;
  }
  EXPECT_NEAR(check_mesh(mesh("mm.ply", {.unit = "mm"})).box_max.x(), 0.04, 1e-3);
  EXPECT_NEAR(check_mesh(mesh("mm.ply", {.unit = "0.002"})).box_max.x(), 0.08, 2e-3);
  EXPECT_THROW(mesh("mm.ply", {.unit = "furlong"}), UserError);
}

TEST_F(ImportTest, InsideOutIsTurnedAndTold) {
  auto ball = datasets::icosphere(0.04, 2);
  for (auto& t : ball.triangles) std::swap(t[0], t[1]);
  geometry::write_ply(folder_ / "in.ply", ball);
  EXPECT_GT(check_mesh(mesh("in.ply")).volume_m3, 0);
  EXPECT_EQ(run_.metrics().at("turned_outward"), 1);
}

TEST_F(ImportTest, TableSceneGivesItsObjectsTheLargestFirst) {
  write_table();
  const Vec3 up = Eigen::AngleAxisd(2.4, Vec3::UnitX()) * Vec3::UnitZ();
  for (const auto& [index, radius] : {std::pair{0, 0.05}, {1, 0.03}}) {
    const auto object = cloud("table.xyz", {.scene = "auto", .cluster = index});
    EXPECT_EQ(run_.metrics().at("clusters"), 2);
    ASSERT_TRUE(object.support);
    // 90,000 points with 0.5 mm of ripple fix the plane far better than that; the balls' feet pull a little.
    EXPECT_GT(object.support->normal.dot(up), 1 - 1e-5);
    EXPECT_NEAR(object.support->height_m(Vec3(0, 0, 0.9)), 0, 5e-4);
    double highest = 0;
    for (const Vec3& p : object.points) highest = std::max(highest, object.support->height_m(p));
    EXPECT_NEAR(highest, 2 * radius, 1.5e-3);
  }
  EXPECT_THROW(cloud("table.xyz", {.cluster = 2}), UserError);
}

TEST_F(ImportTest, NanInAnOrganisedCloudIsNoReturn) {
  std::ofstream(folder_ / "o.pcd")
      << "VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 3\nHEIGHT 2\n"
         "VIEWPOINT 0 0 1 1 0 0 0\nPOINTS 6\nDATA ascii\n0 0 0\nnan nan nan\n0.1 0 0\n0 0.1 0\n"
         "nan nan nan\n0.1 0.1 0.1\n";
  const auto organised = cloud("o.pcd", {.scene = "object"});
  EXPECT_EQ(organised.size(), 4u);
  EXPECT_EQ(organised.sensor_origins.at(0), Vec3(0, 0, 1));
  std::ofstream(folder_ / "u.xyz") << "0 0 0\nnan 0 0\n0.1 0 0\n0 0.1 0\nnan 0 0\n0.1 0.1 0.1\n";
  EXPECT_THROW(cloud("u.xyz", {.scene = "object"}), UserError);  // a third of it is not finite
}

TEST_F(ImportTest, ForeignScansGiveObjects) {
  const char* objects = std::getenv("GEOCAGE_TEST_OBJECTS");
  if (!objects) GTEST_SKIP() << "GEOCAGE_TEST_OBJECTS names no folder";
  for (const char* name : {"scan_mosd_cans_tin.pcd", "scan_mosd_clutter.pcd"}) {
    const auto object = import_cloud({.scene = "table"}, run_, {std::filesystem::path(objects) / name});
    EXPECT_GE(run_.metrics().at("clusters"), 2) << name;
    EXPECT_GT(object.size(), 500u) << name;
  }
}

}  // namespace
}  // namespace geocage::stages
