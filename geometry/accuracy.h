#pragma once
#include <filesystem>
#include <string_view>

#include "geometry/mesh.h"

namespace geocage::geometry {

/// How far a surface is from the true one. Distances are one-sided and sampled (geometry/surface_distance.h);
/// the Hausdorff distance is between `hausdorff_m()` and that plus `sampling_m`.
struct Accuracy {
  double diagonal_m = 0;                         ///< of the true surface's box
  double sampling_m = 0;                         ///< no point of either surface is farther from a sample
  double off_max_m = 0, off_mean_m = 0;          ///< of the surface from the true one
  double missing_max_m = 0, missing_mean_m = 0;  ///< of the true surface from this one
  double observed_mean_m = 0,
         guessed_mean_m = 0;      ///< of vertices observed by half or more, and of the others
  double observed_share = 1;      ///< of the vertices
  int genus = 0, true_genus = 0;  ///< (2 - Euler characteristic) / 2
  bool solid = false;             ///< closed, manifold, outward, one part, doesn't cut itself

  double hausdorff_m() const;
  double mean_m() const;  ///< mean of both ways
};

/// Precondition: both have triangles, valid indices, finite vertices.
Accuracy accuracy_of(const TriangleMesh& surface, const TriangleMesh& truth, double sampling_m);

std::string_view artefact_kind(const Accuracy*);  ///< "accuracy": accuracy.json
void save_artefact(const Accuracy& accuracy, const std::filesystem::path& dir);
void load_artefact(Accuracy& accuracy, const std::filesystem::path& dir);

}  // namespace geocage::geometry
