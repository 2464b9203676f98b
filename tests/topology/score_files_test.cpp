#include <cmath>
#include <cstring>
#include <fstream>

#include <gtest/gtest.h>

#include "datasets/shapes.h"
#include "tests/pipeline/scratch_folder.h"
#include "topology/scores.h"

namespace geocage::topology {
namespace {

Scores some_scores() {
  const auto mesh = datasets::torus(0.04, 0.015, 24, 12);
  Scores scores{{}, mesh, ball_fields(mesh, {0.02}, Metric::hop).radii.front()};
  scores.candidates.push_back({.vertex = 3,
                               .heuristic = "winding",
                               .score = 1.0 / 3,
                               .radius_m = 0.5,
                               .winding_angle_rad = std::nan(""),
                               .curvature_sum_rad = 0.1,
                               .euler = -1,
                               .p_O = Vec3(1, 2, 3) / 7,
                               .n_O = Vec3::UnitY(),
                               .center_O = Vec3(4, 5, 6) / 7,
                               .axis_O = Vec3::UnitX(),
                               .com_offset_m = 0.01 / 7});
  scores.candidates.push_back({.vertex = 5,
                               .heuristic = "loops",
                               .ring_length_m = 0.1 / 3,
                               .neck_length_m = 0.1 / 7,
                               .beside_winding_angle_rad = 4.1,
                               .beside_curvature_sum_rad = 1e-3 / 3});
  return scores;
}

/// NaN equals NaN.
bool same(double a, double b) {
  return std::memcmp(&a, &b, sizeof a) == 0 || (std::isnan(a) && std::isnan(b));
}

TEST(ScoreFiles, ReadBackExactly) {
  const tests::ScratchFolder folder;
  Scores written = some_scores();
  written.mesh.observed.assign(written.mesh.vertices.size(), 1.0 / 3);
  save_artefact(written, folder.path());
  Scores read;
  load_artefact(read, folder.path());
  EXPECT_EQ(read.mesh.vertices, written.mesh.vertices);
  EXPECT_EQ(read.mesh.observed, written.mesh.observed);
  EXPECT_EQ(read.mesh.triangles, written.mesh.triangles);
  EXPECT_EQ(read.ball.curvature_sum_rad, written.ball.curvature_sum_rad);
  EXPECT_EQ(read.ball.axis, written.ball.axis);
  ASSERT_EQ(read.candidates.size(), 2u);
  for (int i = 0; i < 2; ++i) {
    const Candidate &c = read.candidates[i], &w = written.candidates[i];
    EXPECT_EQ(std::tie(c.vertex, c.heuristic, c.euler), std::tie(w.vertex, w.heuristic, w.euler));
    EXPECT_EQ(std::tie(c.p_O, c.n_O, c.center_O, c.axis_O), std::tie(w.p_O, w.n_O, w.center_O, w.axis_O));
    for (double Candidate::*number :
         {&Candidate::score, &Candidate::radius_m, &Candidate::winding_angle_rad,
          &Candidate::curvature_sum_rad, &Candidate::com_offset_m, &Candidate::ring_length_m,
          &Candidate::neck_length_m, &Candidate::beside_winding_angle_rad,
          &Candidate::beside_curvature_sum_rad})
      EXPECT_TRUE(same(c.*number, w.*number)) << i;
  }
}

TEST(ScoreFiles, PlyNamesTheColumnsOfTheContract) {
  const tests::ScratchFolder folder;
  save_artefact(some_scores(), folder.path());
  std::ifstream in(folder / "scores.ply", std::ios::binary);
  std::string header, line;
  while (std::getline(in, line) && line != "end_header") header += line + "\n";
  std::size_t at = 0;
  for (const char* name : {"x", "y", "z", "winding_angle_rad", "curvature_sum_rad", "ball_vertices",
                           "ball_triangles", "euler"}) {
    const auto found = header.find(std::string(" ") + name + "\n", at);
    EXPECT_NE(found, std::string::npos) << name;
    at = found;
  }
}

}  // namespace
}  // namespace geocage::topology
