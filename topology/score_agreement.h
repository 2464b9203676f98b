#pragma once
#include <filesystem>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "topology/scores.h"

namespace geocage::topology {

/// How one field of a noisy mesh agrees with that of the clean one. NaN where either field has no value.
struct FieldAgreement {
  std::string field;                                                   ///< "winding" or "curvature"
  double rank_correlation = std::numeric_limits<double>::quiet_NaN();  ///< Spearman's, over the vertices
  double top_overlap = std::numeric_limits<double>::quiet_NaN();       ///< Jaccard index of the top sets
  /// Way along the clean mesh's edges from where the noisy field is largest to where the clean one is [m]:
  /// the mean over the noisy best vertices of the way to the nearest clean best one.
  double drift_m = std::numeric_limits<double>::quiet_NaN();
};

/// Scores of a noisy mesh against those of the clean one.
struct ScoreAgreement {
  std::vector<FieldAgreement> fields;
  bool same_vertices =
      false;         ///< one connectivity: vertex by vertex; else each with the nearest of the other
  double gap_m = 0;  ///< largest distance of vertices that were compared
  double radius_m = 0, noisy_radius_m = 0;  ///< of the balls that were ranked
};

/// Compares winding angles and curvature sums as measured (rank
/// correlation, overlap of the best `top_share`, drift of the best point). Meshes of one connectivity are
/// compared vertex by vertex; otherwise every vertex takes the value of the nearest one of the other mesh.
/// O(n log n) of one connectivity, else O(n^(5/3)) as a rule.
ScoreAgreement agreement_of(const Scores& clean, const Scores& noisy, double top_share);

/// For each of `points` the index of the nearest of `others` (the lower of equals); -1 when there is none.
std::vector<int> nearest_points(const std::vector<Vec3>& points, const std::vector<Vec3>& others);

std::string_view artefact_kind(const ScoreAgreement*);  ///< "agreement": agreement.json, null for NaN
void save_artefact(const ScoreAgreement& agreement, const std::filesystem::path& dir);
void load_artefact(ScoreAgreement& agreement, const std::filesystem::path& dir);

}  // namespace geocage::topology
