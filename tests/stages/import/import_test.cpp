#include "stages/import/import.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <map>
#include <tuple>

#include <gtest/gtest.h>

#include "datasets/shapes.h"
#include "geometry/mesh_files.h"
#include "pipeline/error.h"
#include "tests/pipeline/scratch_folder.h"
#include "tests/stages/import/label_match.h"

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
  for (const auto& [index, radius] : {std::pair{"largest", 0.05}, {"0", 0.05}, {"1", 0.03}}) {
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
  EXPECT_THROW(cloud("table.xyz", {.cluster = "2"}), UserError);
  EXPECT_THROW(cloud("table.xyz", {.cluster = "all"}), UserError);
  EXPECT_THROW(cloud("table.xyz", {.cluster = "second"}), UserError);
}

TEST_F(ImportTest, ASceneGivesEveryObjectAsACloudOfItsOwn) {
  write_table();
  const auto scene = find_scene({.scene = "table"}, run_, {folder_ / "table.xyz"});
  ASSERT_EQ(scene.objects.size(), 2u);
  for (int k = 0; k < 2; ++k) {
    const auto part = import_part({.object = k}, run_, scene);
    const auto alone = cloud("table.xyz", {.scene = "table", .cluster = std::to_string(k)});
    EXPECT_EQ(part.points, alone.points);
    EXPECT_EQ(part.support->normal, alone.support->normal);
  }
  const tests::ScratchFolder saved;
  save_artefact(scene, saved.path());
  geometry::Scene read;
  load_artefact(read, saved.path());
  EXPECT_EQ(read.cloud.points, scene.cloud.points);
  ASSERT_EQ(read.objects.size(), 2u);
  EXPECT_EQ(read.objects[1].name, "1");
  EXPECT_EQ(read.objects[1].points, scene.objects[1].points);
}

// Cut by shape this scene gives four parts: the default must not take a cup apart.
TEST_F(ImportTest, ABoxAndACupAreOneThingEach) {
  std::vector<Vec3> seen;
  int i = 0;
  const auto put = [&](const Vec3& p) {
    const Vec3 q = Vec3(0, 0, 0.9) + Eigen::AngleAxisd(2.4, Vec3::UnitX()) * p;
    seen.push_back(q + 0.0005 * Vec3(0, 0, std::sin(12.9898 * ++i)));
  };
  const auto put_shape = [&](const geometry::TriangleMesh& mesh, const Vec3& at) {  // even over its area
    for (const auto& t : mesh.triangles) {
      const Vec3 &a = mesh.vertices[t[0]], u = mesh.vertices[t[1]] - a, v = mesh.vertices[t[2]] - a;
      const Vec3 normal = Eigen::AngleAxisd(2.4, Vec3::UnitX()) * u.cross(v), toward(0, 0, -1);
      if (normal.dot(toward) <= 0) continue;  // the sensor sees one side
      const int n = std::max(1, static_cast<int>(std::ceil(std::max(u.norm(), v.norm()) / 0.0015)));
      for (int x = 0; x < n; ++x)
        for (int y = 0; x + y < n; ++y) put(a + u * (x + 0.3) / n + v * (y + 0.3) / n + at);
    }
  };
  for (int x = -150; x <= 150; ++x)
    for (int y = -150; y <= 150; ++y) put({x * 0.002, y * 0.002, 0});
  put_shape(datasets::box({0.12, 0.1, 0.05}), {-0.1, 0, 0.025});
  put_shape(datasets::cup(0.04, 0.09, 0.004, 48), {0.12, 0, 0});
  std::ofstream out(folder_ / "cup.pcd");
  out << "VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH " << seen.size()
      << "\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS " << seen.size() << "\nDATA ascii\n";
  for (const Vec3& p : seen) out << p.transpose() << "\n";
  out.close();
  EXPECT_EQ(find_scene({.scene = "table"}, run_, {folder_ / "cup.pcd"}).objects.size(), 2u);
}

TEST_F(ImportTest, LabelsOfTheFileMayPartTheObjects) {
  write_table();
  std::ifstream in(folder_ / "table.xyz");
  std::ofstream out(folder_ / "labelled.ply");
  std::vector<std::string> lines;
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  out << "ply\nformat ascii 1.0\nelement vertex " << lines.size()
      << "\nproperty float x\nproperty float y\nproperty float z\nproperty int label\nend_header\n";
  const std::size_t table = 301 * 301,
                    large = 10242;  // an icosphere of 5 subdivisions has 10 * 4^5 + 2 vertices
  for (std::size_t k = 0; k < lines.size(); ++k)
    out << lines[k] << " " << (k < table ? 1 : k < table + large ? 7 : 5) << "\n";
  out.close();
  const auto scene = find_scene({.scene = "table", .cluster_by = "label"}, run_, {folder_ / "labelled.ply"});
  ASSERT_EQ(scene.objects.size(), 2u);
  EXPECT_EQ(scene.objects[0].name, "5");
  EXPECT_EQ(scene.objects[1].name, "7");
  const auto seven = cloud("labelled.ply", {.scene = "table", .cluster = "7", .cluster_by = "label"});
  for (int label : seven.label) EXPECT_EQ(label, 7);
  EXPECT_THROW(cloud("table.xyz", {.scene = "table", .cluster = "7", .cluster_by = "label"}), UserError);
}

// The plane is the one that its own points give back, so that neither the order of points nor the frame they
// are given in leaves a trace: the same points belong to the same objects.
TEST_F(ImportTest, PermutingAndTurningChangeNothingButRounding) {
  write_table();
  std::ifstream in(folder_ / "table.xyz");
  std::vector<Vec3> points;
  for (Vec3 p; in >> p.x() >> p.y() >> p.z();) points.push_back(p);
  const geometry::Pose turn = geometry::Pose(Eigen::AngleAxisd(0.7, Vec3(1, 2, 3).normalized()));
  std::ofstream turned(folder_ / "turned.xyz"), permuted(folder_ / "permuted.xyz");
  turned.precision(17);
  permuted.precision(17);
  for (std::size_t i = 0; i < points.size(); ++i) {
    turned << (turn * points[i]).transpose() << "\n";
    permuted << points[(i * 7919) % points.size()].transpose() << "\n";  // 7919 is a prime
  }
  turned.close();
  permuted.close();
  for (const char* which : {"0", "1"}) {
    const ImportParams params{.scene = "table", .cluster = which, .cluster_by = "gap"};
    const auto plain = cloud("table.xyz", params), other = cloud("permuted.xyz", params),
               rotated = cloud("turned.xyz", params);
    EXPECT_EQ(plain.size(), other.size());
    EXPECT_EQ(plain.size(), rotated.size());
    const auto sorted = [](std::vector<Vec3> list) {
      std::sort(list.begin(), list.end(), [](const Vec3& a, const Vec3& b) {
        return std::tuple(a.x(), a.y(), a.z()) < std::tuple(b.x(), b.y(), b.z());
      });
      return list;
    };
    EXPECT_EQ(sorted(plain.points), sorted(other.points));
    ASSERT_EQ(plain.size(), rotated.size());
    for (std::size_t i = 0; i < plain.size(); ++i)  // sums of 1e5 terms of 1 m: 1e-11 at worst
      ASSERT_LT((turn * plain.points[i] - rotated.points[i]).norm(), 1e-11);
    EXPECT_LT((turn.linear() * plain.support->normal - rotated.support->normal).norm(), 1e-11);
  }
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

TEST_F(ImportTest, ForeignScansGiveEveryLabelledObject) {
  const char* objects = std::getenv("GEOCAGE_TEST_OBJECTS");
  if (!objects) GTEST_SKIP() << "GEOCAGE_TEST_OBJECTS names no folder";
  for (const auto& [name, count] : {std::pair{"scan_mosd_cans_tin.pcd", 3}, {"scan_mosd_clutter.pcd", 7}}) {
    const auto scene =
        find_scene({.scene = "table", .cluster_by = "shape"}, run_, {std::filesystem::path(objects) / name});
    const auto match = tests::match_labels(scene, 1000);
    EXPECT_EQ(match.labelled, count) << name;
    EXPECT_EQ(match.found, count) << name;
    EXPECT_EQ(match.objects, count) << name;
    EXPECT_EQ(match.merged, 0) << name;
    EXPECT_EQ(match.split, 0) << name;
  }
  // A carton without a table, though one of its faces holds half of the points.
  const auto milk = find_scene({}, run_, {std::filesystem::path(objects) / "scan_milk_partial.pcd"});
  ASSERT_EQ(milk.objects.size(), 1u);
  EXPECT_EQ(milk.objects[0].points.size(), milk.cloud.size());
}

TEST_F(ImportTest, MeshesAboveTheGuardAreRefusedOrReduced) {
  constexpr double radius = 0.05;
  const auto ball = datasets::icosphere(radius, 5);  // 20480 triangles
  geometry::write_ply(folder_ / "ball.ply", ball);
  ImportParams params;
  params.most_faces = 10000;
  try {
    mesh("ball.ply", params);
    FAIL();
  } catch (const UserError& error) {
    EXPECT_EQ(error.fault(), Fault::input);
    EXPECT_NE(error.sentence().find("20480 faces"), std::string::npos) << error.what();
    EXPECT_NE(error.hint().find("import.decimate"), std::string::npos) << error.what();
  }
  params.decimate = 2000;
  const auto reduced = mesh("ball.ply", params);
  const auto report = check_mesh(reduced);
  EXPECT_EQ(report.euler, 2);
  EXPECT_TRUE(report.closed_manifold());
  EXPECT_NEAR(report.triangles, 2000, 100);
  EXPECT_EQ(run_.metrics().at("decimated_from"), 20480);
  EXPECT_EQ(run_.metrics().at("decimated_to"), report.triangles);
  EXPECT_EQ(run_.metrics().at("decimated_clustered"), 0);
  // Corners stay on the sphere, so the reduced surface lies within by R - sqrt(R^2 - c^2) at most, c the
  // largest circumradius, and by R - |centre| at the centres, which are samples; the given one by less than
  // the same with its own circumradius, 0.6 of its longest edge of 0.038 R: 0.00026 R.
  double least = 0, most = 0;
  for (const auto& t : reduced.triangles) {
    const Vec3 &a = reduced.vertices[t[0]], &b = reduced.vertices[t[1]], &c = reduced.vertices[t[2]];
    EXPECT_NEAR(a.norm(), radius, 1e-7);
    const double round = (b - a).norm() * (c - b).norm() * (a - c).norm() / (2 * (b - a).cross(c - a).norm());
    least = std::max(least, radius - ((a + b + c) / 3).norm());
    most = std::max(most, radius - std::sqrt(radius * radius - round * round));
  }
  const double given = 0.00026 * radius;
  EXPECT_GE(run_.metrics().at("decimated_added_m"), least - given);
  EXPECT_LE(run_.metrics().at("decimated_added_m"), most);
  EXPECT_GE(run_.metrics().at("decimated_lost_m"), (least - given) / 2);
  EXPECT_LE(run_.metrics().at("decimated_lost_m"), most);
}

TEST_F(ImportTest, ReducingKeepsHandlesAndBytes) {
  geometry::write_ply(folder_ / "t.ply", datasets::torus(0.04, 0.015, 120, 60));
  ImportParams params;
  params.most_faces = 5000;
  params.decimate = 3000;
  const auto once = mesh("t.ply", params), again = mesh("t.ply", params);
  EXPECT_EQ(check_mesh(once).euler, 0);
  EXPECT_TRUE(check_mesh(once).closed_manifold());
  EXPECT_EQ(once.triangles, again.triangles);
  EXPECT_EQ(once.vertices, again.vertices);
}

// No two triangles touch: edge by edge, most of them vanish and leave gaps of a quarter of the ball; a grid
// of about a thousand cells has cells of 2 sqrt(pi / 500) radii, 7.9 mm, and moves nothing by their diagonal.
TEST_F(ImportTest, ASoupAboveTheGuardIsReducedByAGrid) {
  geometry::TriangleMesh soup;
  const auto ball = datasets::icosphere(0.05, 4);
  for (const auto& t : ball.triangles) {
    const auto first = static_cast<int>(soup.vertices.size());
    const Vec3 middle = (ball.vertices[t[0]] + ball.vertices[t[1]] + ball.vertices[t[2]]) / 3;
    for (int v : t) soup.vertices.push_back(middle + 0.9 * (ball.vertices[v] - middle));
    soup.triangles.push_back({first, first + 1, first + 2});
  }
  geometry::write_ply(folder_ / "soup.ply", soup);
  ImportParams params;
  params.most_faces = 5000;
  params.decimate = 1000;
  params.repair = "none";
  const auto reduced = mesh("soup.ply", params);
  EXPECT_EQ(run_.metrics().at("decimated_clustered"), 1);
  EXPECT_LE(reduced.triangles.size(), 1000u);
  EXPECT_GT(reduced.triangles.size(), 300u);
  EXPECT_LT(run_.metrics().at("decimated_lost_m"), 0.0137);
}

}  // namespace
}  // namespace geocage::stages
