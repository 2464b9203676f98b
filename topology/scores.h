#pragma once
#include <limits>
#include <string>

#include "topology/balls.h"

namespace geocage::topology {

/// A vertex that a hand may be placed at.
struct Candidate {
  int vertex = 0;
  std::string heuristic;  ///< "winding", "curvature", "combined", "loops" or "random"
  double score = 0;       ///< normalised to [0, 1] over the mesh
  double radius_m = 0;
  double winding_angle_rad = 0, curvature_sum_rad = 0;
  int euler = 0;
  Vec3 p_O = Vec3::Zero(), n_O = Vec3::UnitZ();
  /// What the hand closes around: the ball's mean and principal axis (zero where there is none); of "loops"
  /// the loop's mean and the direction of what runs through it.
  Vec3 center_O = Vec3::Zero(), axis_O = Vec3::Zero();
  double com_offset_m = 0;  ///< of the centre of mass from the line p - t n
  /// Of the loop, or of the closed curve in which the ball's plane cuts the surface; NaN where there is none.
  double ring_length_m = std::numeric_limits<double>::quiet_NaN();
  /// Of that curve pulled tight: the neck that a closed hand slips into and stays; NaN where it slips off.
  double neck_length_m = std::numeric_limits<double>::quiet_NaN();
  /// The same vertex's ball by the other metric; NaN where that was not asked for.
  double beside_winding_angle_rad = std::numeric_limits<double>::quiet_NaN();
  double beside_curvature_sum_rad = std::numeric_limits<double>::quiet_NaN();
};

/// Scores of a mesh for one hand: candidates best first within each heuristic, and the fields they came from.
struct Scores {
  std::vector<Candidate> candidates;
  geometry::TriangleMesh mesh;
  BallFields ball;
};

std::string_view artefact_kind(const Scores*);  ///< "scores": scores.ply (mesh and fields), candidates.json
void save_artefact(const Scores& scores, const std::filesystem::path& dir);
void load_artefact(Scores& scores, const std::filesystem::path& dir);

}  // namespace geocage::topology
