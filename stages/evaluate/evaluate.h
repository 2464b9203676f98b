#pragma once
#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "physics/controls.h"
#include "physics/lift_trial.h"
#include "physics/margins.h"
#include "physics/outcome.h"
#include "physics/protocols.h"
#include "physics/recording.h"
#include "physics/self_check.h"
#include <nlohmann/json_fwd.hpp>

#include "geometry/distance_field.h"
#include "hands/grasp.h"
#include "hands/hand.h"
#include "motion/trajectory.h"
#include "pipeline/stage.h"

namespace geocage::stages {

struct EvaluateParams {
  std::string protocol = "geocage-force";
  double friction = physics::Engine{}.friction;
  std::string loads = "axes";
  double push_m_s2 = physics::Protocol{}.acceleration_m_s2;
  std::string weight = "mass";
  double mass_kg = physics::Protocol{}.mass_kg, density_kg_m3 = 500;
  std::string object_geometry = "truth";
  int control_grasps = 4;
  int self_check_trials = 6;
  int recorded_grasps = 1;
  int lift_grasps = 1;
  int margin_grasps = 0;
  int margin_draws = 20;
  std::uint64_t seed = 0;
  void visit(pipeline::Fields& f);
};

/// The named protocol, with the friction, push and weight that geocage's own test lets one choose. UserError
/// (configuration): an unknown protocol, or a choice that a protocol of others does not have.
physics::Protocol protocol_of(const EvaluateParams& params);

using physics::Outcome;

/// Beside the protocol's own limits, pushes are counted that move the object by less than this (MultiDex's
/// and DRO-Grasp's limit).
inline constexpr double strict_m = 0.02;

/// One push of a grasp, or one torque.
struct DirectionResult {
  std::string name;  ///< "+x", "turn +x"
  Outcome outcome = Outcome::held;
  double max_displacement_m = 0, max_rotation_rad = 0;  ///< from the settled pose, against the palm
  double ended_s = 0;                                   ///< after the push began: lost, at rest, or time over

  bool held() const { return outcome == Outcome::held; }
  bool held_strictly() const { return held() && max_displacement_m < strict_m; }
};

/// One grasp under all loads.
struct Evaluation {
  int grasp = 0;  ///< index into the grasps
  Outcome outcome = Outcome::held;
  std::string reason;
  double start_penetration_m = 0, max_penetration_m = 0;
  double drift_m = 0, drift_rad = 0;  ///< while the hand closed and settled, before the pushes
  std::vector<DirectionResult> directions;
  std::optional<physics::LiftTrial> lift;        ///< where it was asked
  std::optional<physics::ForceMargins> margins;  ///< likewise

  int held_pushes(bool strictly) const;
  /// Held against all of them, each within `strict_m`.
  bool held_strictly() const {
    return outcome == Outcome::held && held_pushes(true) == static_cast<int>(directions.size());
  }
  /// The push that was lost first, else the one that moved the object farthest; none where none was made to
  /// its end.
  const DirectionResult* worst() const;
};

/// All grasps of a set under one protocol.
struct Evaluations {
  EvaluateParams params;
  std::vector<Evaluation> list;
  std::vector<physics::Control> controls;
  physics::SelfCheck self_check;
  std::vector<physics::Recording> recordings;  ///< all pushes of the first grasps that were simulated

  int count(Outcome outcome) const;
  int starts_within_1_mm() const;  ///< grasps whose hand starts less deep in the object
  bool valid() const { return std::ranges::all_of(controls, &physics::Control::ok); }
};

/// Loads the object in each grasp's closing hand (README: a force test, not a cage test). The grasps may
/// come from a reconstruction; `object` and `field` are the same geometry, named by `object_geometry`. One
/// trajectory a grasp, or none at all: a grasp whose trajectory is not "planned" is rejected. Errors
/// (UserError): unknown protocol or loads (configuration); a pose or joint that is NaN, unknown, out of
/// limits, of another hand, or another number of trajectories than grasps (input); a mesh without volume
/// (geometry). O(grasps * directions * steps); same bytes for any thread count.
Evaluations evaluate(const EvaluateParams& params, pipeline::Run& run, const hands::GraspSet& grasps,
                     const motion::TrajectorySet& trajectories, const geometry::TriangleMesh& object,
                     const geometry::SignedDistanceField& field, const hands::Hand& hand);

inline constexpr pipeline::Stage evaluate_stage{"evaluate", 13, &evaluate};

/// The document "geocage-evaluation 1" of one entry (docs/architecture.md, section 4).
nlohmann::json to_json(const Evaluations& all, const Evaluation& evaluation);

std::string_view artefact_kind(const Evaluations*);  ///< "evaluations": evaluations.json, recordings.json
void save_artefact(const Evaluations& all, const std::filesystem::path& dir);
void load_artefact(Evaluations& all, const std::filesystem::path& dir);

}  // namespace geocage::stages
