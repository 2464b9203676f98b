#include "geometry/mesh.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "datasets/shapes.h"
#include "geometry/boundary.h"
#include "tests/pipeline/scratch_folder.h"

namespace geocage::geometry {
namespace {

TEST(CheckMesh, EulerCharacteristicOfKnownShapes) {
  EXPECT_EQ(check_mesh(datasets::cube()).euler, 2);
  EXPECT_EQ(check_mesh(datasets::icosphere(1, 3)).euler, 2);
  EXPECT_EQ(check_mesh(datasets::torus(1, 0.3, 20, 10)).euler, 0);
  EXPECT_EQ(check_mesh(datasets::open_tube(1, 2, 12, 4)).euler, 0);
  EXPECT_EQ(check_mesh(datasets::flat_grid(1, 3)).euler, 1);
}

TEST(CheckMesh, ClosedAndOpen) {
  for (const auto& mesh :
       {datasets::tetrahedron(), datasets::cup(0.04, 0.1, 0.003, 24), datasets::box({1, 2, 3}, 3)}) {
    const MeshReport report = check_mesh(mesh);
    EXPECT_TRUE(report.closed_manifold()) << flaw(report);
    EXPECT_EQ(flaw(report), "");
    EXPECT_EQ(report.components, 1);
  }
  const MeshReport open = check_mesh(datasets::open_tube(1, 2, 12, 4));
  EXPECT_FALSE(open.closed_manifold());
  EXPECT_EQ(open.boundary_edges, 24);
  EXPECT_NE(flaw(open).find("not closed"), std::string::npos);
}

TEST(CheckMesh, RimsAreCounted) {
  EXPECT_EQ(boundary_loops(datasets::open_tube(1, 2, 12, 4)), 2);
  auto ball = datasets::icosphere(1, 2);
  EXPECT_EQ(boundary_loops(ball), 0);
  ball.triangles.erase(ball.triangles.begin() + 7);
  EXPECT_EQ(boundary_loops(ball), 1);
}

TEST(CheckMesh, NamesTheFirstOffender) {
  auto mesh = datasets::icosphere(1, 1);
  mesh.vertices[5].z() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(flaw(check_mesh(mesh)), "vertex 5 is not finite");
  mesh = datasets::cube();
  mesh.triangles[3][1] = 99;
  EXPECT_EQ(flaw(check_mesh(mesh)), "triangle 3 names a vertex that is not there");
  mesh = datasets::cube();
  mesh.triangles[2][1] = mesh.triangles[2][0];
  EXPECT_EQ(flaw(check_mesh(mesh)), "triangle 2 has no area");
}

TEST(CheckMesh, TurnedTriangleIsInconsistent) {
  auto mesh = datasets::cube();
  std::swap(mesh.triangles[0][0], mesh.triangles[0][1]);
  EXPECT_EQ(check_mesh(mesh).inconsistent_edges, 3);
}

TEST(CheckMesh, PinchedVertex) {
  // Two tetrahedra that share one vertex: every edge is fine, the vertex has two fans.
  auto mesh = datasets::tetrahedron();
  const auto first = mesh;
  for (const auto& p : first.vertices) mesh.vertices.push_back(2 * first.vertices[0] - p);
  for (auto t : first.triangles) {
    for (int& v : t) v = v == 0 ? 0 : v + 4;
    mesh.triangles.push_back({t[0], t[2], t[1]});
  }
  const MeshReport report = check_mesh(mesh);
  EXPECT_EQ(report.non_manifold_edges, 0);
  EXPECT_EQ(report.non_manifold_vertices, 1);
  EXPECT_EQ(report.isolated_vertices, 1);
  EXPECT_FALSE(report.closed_manifold());
}

TEST(Mass, BoxInClosedForm) {
  auto box = datasets::box({0.2, 0.4, 0.6}, 3);
  const Vec3 shift(5, -3, 2);
  for (auto& p : box.vertices) p += shift;
  const MassProperties mass = mass_properties(box);
  const double m = 0.2 * 0.4 * 0.6;
  EXPECT_NEAR(mass.volume_m3, m, 1e-12);
  EXPECT_LT((mass.center - shift).norm(), 1e-12);
  // Coordinates of size 5 give products of size 25 x eps; the reference on the box keeps it below 1e-14.
  EXPECT_NEAR(mass.inertia(0, 0), m / 12 * (0.16 + 0.36), 1e-13);
  EXPECT_NEAR(mass.inertia(1, 1), m / 12 * (0.04 + 0.36), 1e-13);
  EXPECT_NEAR(mass.inertia(2, 2), m / 12 * (0.04 + 0.16), 1e-13);
  EXPECT_NEAR(mass.inertia(0, 1), 0, 1e-13);
}

TEST(Mass, InertiaTurnsWithTheBody) {
  auto mesh = datasets::cup(0.04, 0.1, 0.003, 24);
  const auto before = mass_properties(mesh);
  const Pose X(Eigen::Translation3d(0.3, -0.2, 0.1) * Eigen::AngleAxisd(0.7, Vec3(1, 2, 3).normalized()));
  for (auto& p : mesh.vertices) p = X * p;
  const auto after = mass_properties(mesh);
  EXPECT_LT((after.center - X * before.center).norm(), 1e-14);
  EXPECT_LT((after.inertia - X.linear() * before.inertia * X.linear().transpose()).norm(),
            1e-12 * before.inertia.norm() + 1e-18);
}

TEST(Mesh, InsideOutIsTurned) {
  auto mesh = datasets::cube();
  EXPECT_FALSE(orient_outward(mesh));
  for (auto& t : mesh.triangles) std::swap(t[0], t[1]);
  EXPECT_TRUE(orient_outward(mesh));
  EXPECT_GT(check_mesh(mesh).volume_m3, 0);
}

TEST(Mesh, NormalsOfASpherePointAway) {
  const auto mesh = datasets::icosphere(1, 3);
  const auto normals = vertex_normals(mesh);
  // Area weights on a near-regular mesh: off by less than a tenth of an edge.
  for (std::size_t v = 0; v < normals.size(); ++v) EXPECT_GT(normals[v].dot(mesh.vertices[v]), 1 - 1e-3);
}

TEST(Mesh, AreasAddUp) {
  const auto mesh = datasets::torus(1, 0.3, 20, 10);
  double sum = 0;
  for (double area : vertex_areas_m2(mesh)) sum += area;
  EXPECT_NEAR(sum, check_mesh(mesh).area_m2, 1e-12);
}

TEST(Mesh, NeighboursAreSymmetricAndComplete) {
  const auto mesh = datasets::icosphere(1, 1);
  const auto neighbours = vertex_neighbours(mesh);
  EXPECT_EQ(neighbours.items.size(), 2u * static_cast<std::size_t>(check_mesh(mesh).edges));
  for (int v = 0; v < 42; ++v) EXPECT_TRUE(neighbours.size(v) == 5 || neighbours.size(v) == 6);
  EXPECT_EQ(vertex_triangles(mesh).items.size(), 3 * mesh.triangles.size());
}

TEST(Mesh, PlyReadsBackExactly) {
  const tests::ScratchFolder folder;
  const auto mesh = datasets::icosphere(1.0 / 3, 2);
  std::vector<double> values(mesh.vertices.size(), 0.1);
  values[3] = std::numeric_limits<double>::quiet_NaN();
  write_ply(folder / "m.ply", mesh, {{"score", values}});
  std::vector<VertexField> fields;
  const auto read = read_own_ply(folder / "m.ply", &fields);
  EXPECT_EQ(read.vertices, mesh.vertices);
  EXPECT_EQ(read.triangles, mesh.triangles);
  ASSERT_EQ(fields.size(), 1u);
  EXPECT_EQ(fields[0].name, "score");
  EXPECT_EQ(fields[0].values[2], 0.1);
  EXPECT_TRUE(std::isnan(fields[0].values[3]));
}

TEST(Mesh, ArtefactKeepsWhatWasObserved) {
  const tests::ScratchFolder folder;
  auto mesh = datasets::tetrahedron();
  TriangleMesh read;
  save_artefact(mesh, folder.path());
  load_artefact(read, folder.path());
  EXPECT_TRUE(read.observed.empty());
  mesh.observed = {1, 0.1, 0, 1.0 / 3};
  save_artefact(mesh, folder.path());
  load_artefact(read, folder.path());
  EXPECT_EQ(read.observed, mesh.observed);
  EXPECT_EQ(read.vertices, mesh.vertices);
}

TEST(Frames, FromZIsARotation) {
  for (const Vec3& z : {Vec3(0, 0, 1), Vec3(1, 0, 0), Vec3(1, -2, 0.5).normalized(), Vec3(0, -1, 0)}) {
    const Eigen::Matrix3d R = frame_from_z(z);
    EXPECT_LT((R * R.transpose() - Eigen::Matrix3d::Identity()).norm(), 1e-14);
    EXPECT_NEAR(R.determinant(), 1, 1e-14);
    EXPECT_LT((R.col(2) - z).norm(), 1e-15);
  }
}

}  // namespace
}  // namespace geocage::geometry
