#pragma once
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace geocage::reports {

/// One push of one grasp.
struct DirectionResult {
  std::string name;
  bool held = false, held_within_2_cm = false;
  double max_displacement_m = 0, max_rotation_rad = 0;
};

/// Lift, shake and release of one grasp.
struct LiftResult {
  std::string outcome, phase;  ///< phase: the last one before the hand opens
  bool released = false;       ///< held, and fell when the hand opened
};

struct EvaluationResult {
  int grasp = 0;
  std::string outcome, reason;
  double drift_m = 0, drift_rad = 0;
  bool held_within_2_cm = false;
  std::string worst;             ///< push; empty where none was made to its end
  std::optional<double> fall_s;  ///< when the first push was lost
  std::vector<DirectionResult> directions;
  std::optional<LiftResult> lift;  ///< where it was asked
};

/// A test whose answer is known.
struct ControlResult {
  std::string name, rule;
  int grasps = 0, trials = 0, held = 0, passed = 0;
  bool ok = true;
};

/// What "geocage-evaluations 1" says.
struct Evaluations {
  std::string protocol, object_geometry;
  std::map<std::string, int> counts;  ///< grasps by outcome
  std::vector<ControlResult> controls;
  std::vector<std::pair<std::string, std::string>> engine;  ///< settings as text
  std::vector<EvaluationResult> grasps;

  int held() const;
  int held_within_2_cm() const;
  bool valid() const;  ///< every control answers as it must
};
Evaluations read_evaluations(const std::filesystem::path& folder);

/// Random wrenches of one amplitude.
struct WrenchResult {
  double weights = 0, survival = 0, mean_held_s = 0;
};

/// One grasp of "geocage-cages 1".
struct CageResult {
  int grasp = 0;
  std::string outcome, reason, search;   ///< search: "found", "not found", "stuck"
  std::vector<WrenchResult> amplitudes;  ///< smallest first
  std::string half;                      ///< a_50 in words: "1.41", "below 0.5"; empty without wrenches
  std::optional<double> half_weights;    ///< where it is no bound
  std::optional<double> rise_m;          ///< least over gravity's six axes of the ways found
  int searches_found = 0, compliant = 0, compliant_retained = 0;
  int pulls = 0, pulls_retained = 0, ring = 0, ring_retained = 0, wrenches = 0, wrenches_lost = 0;
};
struct Cages {
  std::vector<ControlResult> controls;
  std::vector<CageResult> grasps;

  bool valid() const;
};
Cages read_cages(const std::filesystem::path& folder);

/// What "geocage-trajectory 1" says, but for the way itself.
struct Approach {
  std::string outcome;
  double seconds = 0, min_clearance_m = 0;
  bool certified = false;
};
/// trajectory_<i>.json, i = 0, 1, ...
std::vector<Approach> read_approaches(const std::filesystem::path& folder);

}  // namespace geocage::reports
