#pragma once
#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "physics/controls.h"
#include "physics/escape_search.h"
#include "physics/margins.h"
#include "physics/outcome.h"
#include "physics/recording.h"
#include "physics/self_check.h"
#include "physics/survival.h"
#include <nlohmann/json_fwd.hpp>

#include "geometry/distance_field.h"
#include "hands/grasp.h"
#include "hands/hand.h"
#include "pipeline/stage.h"

namespace geocage::stages {

struct CageParams {
  std::string object_geometry = "truth";
  std::vector<double> wrench_amplitudes = {0.5, 1, 2, 5};
  int wrench_seeds = 4;
  int search_samples = 1000, search_seeds = 5;
  double damping_s = physics::CageEngine{}.damping_s;
  double step_s = physics::CageEngine{}.dt_s;
  int control_grasps = 2, compliant_grasps = 1;
  int self_check_trials = 6;
  int recorded_grasps = 1;
  int margin_grasps = 1;
  int energy_grasps = 1;
  std::uint64_t seed = 0;
  void visit(pipeline::Fields& f);
};

/// Gravity along one axis, or along one direction of the ring's plane.
struct CagePull {
  std::string name;
  physics::Outcome outcome = physics::Outcome::held;
  double max_displacement_m = 0, max_rotation_rad = 0, ended_s = 0;
};

/// All random wrenches of one amplitude.
struct CageWrench {
  double amplitude = 0;  ///< of force in weights, of torque in weights times the radius of gyration
  int trials = 0, lost = 0, errors = 0;
  double survival = 0;     ///< Kaplan-Meier share still held at the end
  double mean_held_s = 0;  ///< of at most the length of a trial
  std::vector<physics::SurvivalStep> curve;
};

/// One grasp, fingers locked, no friction.
struct CageEvaluation {
  int grasp = 0;  ///< index into the grasps
  physics::Outcome outcome = physics::Outcome::held;
  std::string reason;
  double start_penetration_m = 0, max_penetration_m = 0;
  double backed_off_m = 0;  ///< the farthest that a capsule was moved out of the object before locking
  std::vector<CagePull> pulls, ring;  ///< six axes of O; four directions across the hand's flexion axis
  std::vector<CagePull> compliant;    ///< the six with motors that give way; empty where it was not asked
  std::vector<CageWrench> wrenches;
  std::optional<physics::HalfAmplitude> half;  ///< a_50 of the wrenches
  physics::EscapeSearch search;
  std::vector<physics::Loosening>
      loosening;  ///< of each finger; empty where it was not asked, or nothing held

  int retained() const { return held(pulls); }
  int ring_retained() const { return held(ring); }
  static int held(const std::vector<CagePull>& pulls) {
    return static_cast<int>(std::ranges::count(pulls, physics::Outcome::held, &CagePull::outcome));
  }
};

struct CageEvaluations {
  CageParams params;
  std::vector<CageEvaluation> list;
  std::vector<physics::Control> controls;
  physics::SelfCheck self_check;
  std::vector<physics::Recording> recordings;  ///< all trials of the first grasps; one wrench an amplitude

  int count(physics::Outcome outcome) const {
    return static_cast<int>(std::ranges::count(list, outcome, &CageEvaluation::outcome));
  }
  bool valid() const { return std::ranges::all_of(controls, &physics::Control::ok); }
};

/// Locks the hand at each grasp and tries to lose the object without friction: gravity along six axes,
/// gravity across the closing axis with that axis locked (the ring test), random wrenches, and a search for a
/// way out (docs of the room; thesis 3, evaluation tier B). Errors (UserError): a bad grasp (input), a mesh
/// without volume (geometry), a field that ends before the hand does (configuration). Same bytes for any
/// thread count.
CageEvaluations cage(const CageParams& params, pipeline::Run& run, const hands::GraspSet& grasps,
                     const geometry::TriangleMesh& object, const geometry::SignedDistanceField& field,
                     const hands::Hand& hand);

inline constexpr pipeline::Stage cage_stage{"cage", 10, &cage};

/// The document "geocage-evaluation 1" of one entry, with `ring`, `wrenches` and `escape_search` beside
/// `directions`.
nlohmann::json to_json(const CageEvaluations& all, const CageEvaluation& evaluation);

std::string_view artefact_kind(const CageEvaluations*);  ///< "cages": cages.json, recordings.json
void save_artefact(const CageEvaluations& all, const std::filesystem::path& dir);
void load_artefact(CageEvaluations& all, const std::filesystem::path& dir);

}  // namespace geocage::stages
