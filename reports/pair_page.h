#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "geometry/cloud.h"
#include "hands/grasp.h"
#include "reports/report.h"
#include "reports/results.h"
#include "reports/statistics.h"
#include "topology/scores.h"

namespace geocage::reports {

/// A pair with what its artefacts hold.
struct PairResults {
  PairInput input;
  std::optional<geometry::PointCloud> cloud;
  std::optional<topology::Scores> scores;
  std::optional<hands::GraspSet> grasps;
  std::optional<Evaluations> evaluations;
  std::optional<Cages> cages;
  std::vector<Approach> approaches;

  Proportion held_rate() const;  ///< of all grasps, those included that were not simulated
  /// Index of the first grasp that was held, else of the first; nothing without grasps.
  std::optional<int> best_grasp() const;
  geometry::Vec3 up_O() const;
};
PairResults load_pair(const PairInput& input);

/// A picture in a folder, and what to say of it (HTML).
struct Figure {
  std::string file, title, caption;
};
/// Scan, scores and best grasp, as far as they are there; `prefix` begins the files' names. `frugal`: a
/// quarter of the bytes, for reports of many pairs.
std::vector<Figure> draw_pair(const PairResults& pair, const std::vector<hands::Hand>& hands,
                              const std::filesystem::path& folder, const std::string& prefix,
                              bool frugal = false);

/// The section of a pair: figures, held rate, null control, grasps, rejected poses.
std::string pair_section(const PairResults& pair, const std::vector<Figure>& figures, const std::string& id);

}  // namespace geocage::reports
