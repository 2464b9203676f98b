#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "geometry/mesh.h"

namespace geocage::study {

/// Product of the principal curvatures [1/m2] of each vertex, from a quadric fitted to its two rings
/// (Cazals and Pouget 2005, by CGAL): the local field that the scores are compared with.
std::vector<double> jet_curvature_products(const geometry::TriangleMesh& mesh);

struct MeasureOptions {
  double edge_length_m = 0.004;
  std::vector<double> radii_m = {0.045, 0.06};
  std::vector<double> sigmas_edges = {0.1, 0.2, 0.3, 0.5};
  int seeds = 10;
};

/// Remeshes a closed mesh as the pipeline does and writes a CSV: how each field of a noisy copy agrees with
/// that of the clean mesh; a row for every field, direction of noise, sigma and seed.
void measure(const std::filesystem::path& mesh, const std::string& unit, const MeasureOptions& options,
             const std::filesystem::path& csv);

/// Reads the CSVs of `measure` and writes summary.md and score-noise.svg beside them.
void summarise(const std::filesystem::path& folder);

}  // namespace geocage::study
