#include <algorithm>
#include <cmath>
#include <fstream>

#include <nlohmann/json.hpp>

#include "pipeline/error.h"
#include "pipeline/text_file.h"
#include "stages/evaluate/evaluate.h"

namespace geocage::stages {
namespace {

using nlohmann::json;

/// Limits that a protocol does not have are null.
json finite(double value) {
  return std::isfinite(value) ? json(value) : json();
}

json direction_json(const DirectionResult& result) {
  return {{"name", result.name},
          {"held", result.held()},
          {"held_within_2_cm", result.held_strictly()},
          {"outcome", physics::name(result.outcome)},
          {"max_displacement_m", result.max_displacement_m},
          {"max_rotation_rad", result.max_rotation_rad},
          {"ended_s", result.ended_s}};
}

Outcome outcome_named(const std::string& text) {
  for (const Outcome outcome : physics::outcomes)
    if (physics::name(outcome) == text) return outcome;
  throw pipeline::UserError(pipeline::Fault::store, "evaluations.json", "unknown outcome '" + text + "'",
                            "run `geocage verify`");
}

/// All that the outcome depends on besides the grasp and the object.
json engine_json(const EvaluateParams& params) {
  const physics::Protocol protocol = protocol_of(params);
  const physics::Engine& engine = protocol.engine;
  const physics::Grip& grip = protocol.grip;
  return {{"name", "Bullet"},
          {"version", "3.24, double precision"},
          {"stage_version", evaluate_stage.version},
          {"object_geometry", params.object_geometry},
          {"object_shape", "signed distance field against capsules"},
          {"dt_s", engine.dt_s},
          {"iterations", engine.iterations},
          {"margin_m", 0},
          {"contact_m", engine.contact_m},
          {"way_out_m_s", engine.way_out_m_s},
          {"mu", engine.friction},
          {"mu_rule", "product of the bodies' coefficients, each sqrt(mu); cone, two directions"},
          {"torsional_m", engine.torsional_m ? json(*engine.torsional_m) : json()},
          {"torsional_rule", "times the contact's force; null: mu times the hand's torsion_m"},
          {"mass_kg", protocol.density_kg_m3 ? json() : json(protocol.mass_kg)},
          {"density_kg_m3", protocol.density_kg_m3 ? json(*protocol.density_kg_m3) : json()},
          {"linear_damping_1ps", engine.linear_damping_1ps},
          {"angular_damping_1ps", engine.angular_damping_1ps},
          {"numbers_from", protocol.source},
          {"hand_density_kg_m3", engine.hand_density_kg_m3},
          {"acceleration_m_s2", protocol.acceleration_m_s2},
          {"loads", params.loads},
          {"settle_s", protocol.settle_s},
          {"push_s", protocol.push_s},
          {"max_translation_m", finite(protocol.max_translation_m)},
          {"max_rotation_rad", finite(protocol.max_rotation_rad)},
          {"held_means", protocol.contact_holds ? "some contact is left" : "below both limits at all times"},
          {"max_drift_m", protocol.max_drift_m},
          {"max_drift_rad", protocol.max_drift_rad},
          {"max_start_penetration_m", protocol.max_start_penetration_m},
          {"max_penetration_growth_m", protocol.max_penetration_growth_m},
          {"torque_limit_nm", grip.torque_limit_nm},
          {"force_limit_n", grip.force_limit_n},
          {"squeeze_rad", grip.squeeze_rad},
          {"squeeze_m", grip.squeeze_m}};
}

/// Parameters that stand in the file only where they are not the defaults.
json chosen_json(const EvaluateParams& params) {
  const EvaluateParams usual;
  json chosen = json::object();
  if (params.push_m_s2 != usual.push_m_s2) chosen["push_m_s2"] = params.push_m_s2;
  if (params.weight != usual.weight) chosen["weight"] = params.weight;
  if (params.mass_kg != usual.mass_kg) chosen["mass_kg"] = params.mass_kg;
  if (params.density_kg_m3 != usual.density_kg_m3) chosen["density_kg_m3"] = params.density_kg_m3;
  return chosen;
}

json lift_json(const std::optional<physics::LiftTrial>& lift) {
  if (!lift) return {};
  return {{"outcome", physics::name(lift->outcome)},
          {"phase", lift->phase},
          {"released", lift->released},
          {"max_displacement_m", lift->displacement_m},
          {"max_rotation_rad", lift->rotation_rad},
          {"ended_s", lift->ended_s},
          {"max_penetration_m", lift->penetration_m}};
}

std::optional<physics::LiftTrial> lift_from(const json& entry) {
  if (entry.is_null()) return {};
  physics::LiftTrial lift;
  lift.outcome = outcome_named(entry.at("outcome")), lift.phase = entry.at("phase");
  lift.released = entry.at("released");
  lift.displacement_m = entry.at("max_displacement_m"), lift.rotation_rad = entry.at("max_rotation_rad");
  lift.ended_s = entry.at("ended_s"), lift.penetration_m = entry.at("max_penetration_m");
  return lift;
}

/// Of the pushes: how many held, their mean, the worst, and when the first was lost.
json summary_json(const Evaluation& evaluation) {
  const DirectionResult* worst = evaluation.worst();
  const auto pushes = static_cast<double>(evaluation.directions.size());
  const int held = evaluation.held_pushes(false);
  return {{"pushes", evaluation.directions.size()},
          {"held", held},
          {"held_share", pushes > 0 ? held / pushes : 0},
          {"held_within_2_cm", evaluation.held_pushes(true)},
          {"worst", worst ? json(worst->name) : json()},
          {"fall_s", worst && !worst->held() ? json(worst->ended_s) : json()}};
}

json counts_json(const std::vector<Evaluation>& evaluations) {
  json counts;
  for (const Outcome outcome : physics::outcomes)
    counts[std::string(physics::name(outcome))] =
        std::ranges::count(evaluations, outcome, &Evaluation::outcome);
  return counts;
}

Evaluation evaluation_from(const json& entry) {
  Evaluation evaluation{.grasp = entry.at("grasp"),
                        .outcome = outcome_named(entry.at("outcome")),
                        .reason = entry.at("reason"),
                        .start_penetration_m = entry.at("start_penetration_m"),
                        .max_penetration_m = entry.at("max_penetration_m"),
                        .drift_m = entry.at("drift_m"),
                        .drift_rad = entry.at("drift_rad"),
                        .directions = {},
                        .lift = lift_from(entry.at("lift")),
                        .margins = {}};
  if (!entry.at("margins").is_null()) evaluation.margins = physics::force_margins_from(entry.at("margins"));
  for (const json& direction : entry.at("directions"))
    evaluation.directions.push_back({direction.at("name"), outcome_named(direction.at("outcome")),
                                     direction.at("max_displacement_m"), direction.at("max_rotation_rad"),
                                     direction.at("ended_s")});
  return evaluation;
}

}  // namespace

json to_json(const Evaluations& all, const Evaluation& evaluation) {
  json directions = json::array();
  for (const DirectionResult& result : evaluation.directions) directions.push_back(direction_json(result));
  return {{"schema", "geocage-evaluation 1"},
          {"grasp", evaluation.grasp},
          {"protocol", all.params.protocol},
          {"outcome", physics::name(evaluation.outcome)},
          {"reason", evaluation.reason},
          {"directions", directions},
          {"held_within_2_cm", evaluation.held_strictly()},
          {"summary", summary_json(evaluation)},
          {"lift", lift_json(evaluation.lift)},
          {"margins", evaluation.margins ? physics::to_json(*evaluation.margins) : json()},
          {"drift_m", evaluation.drift_m},
          {"drift_rad", evaluation.drift_rad},
          {"start_penetration_m", evaluation.start_penetration_m},
          {"max_penetration_m", evaluation.max_penetration_m},
          {"counts", counts_json({evaluation})},
          {"engine", engine_json(all.params)},
          {"seed", all.params.seed}};
}

std::string_view artefact_kind(const Evaluations*) {
  return "evaluations";
}

void save_artefact(const Evaluations& all, const std::filesystem::path& dir) {
  json entries = json::array();
  for (const Evaluation& evaluation : all.list) entries.push_back(to_json(all, evaluation));
  json file = {{"schema", "geocage-evaluations 1"},
               {"protocol", all.params.protocol},
               {"friction", all.params.friction},
               {"loads", all.params.loads},
               {"object_geometry", all.params.object_geometry},
               {"control_grasps", all.params.control_grasps},
               {"self_check_trials", all.params.self_check_trials},
               {"recorded_grasps", all.params.recorded_grasps},
               {"lift_grasps", all.params.lift_grasps},
               {"margin_grasps", all.params.margin_grasps},
               {"margin_draws", all.params.margin_draws},
               {"seed", all.params.seed},
               {"counts", counts_json(all.list)},
               {"starts_within_1_mm", all.starts_within_1_mm()},
               {"held_within_2_cm", std::ranges::count_if(all.list, &Evaluation::held_strictly)},
               {"controls", physics::to_json(all.controls)},
               {"valid", all.valid()},
               {"self_check", physics::to_json(all.self_check)},
               {"evaluations", entries}};
  file.update(chosen_json(all.params));
  pipeline::write_text(dir / "evaluations.json", file.dump(1) + "\n");
  pipeline::write_text(dir / "recordings.json", physics::to_json(all.recordings).dump() + "\n");
}

void load_artefact(Evaluations& all, const std::filesystem::path& dir) {
  std::ifstream in(dir / "evaluations.json");
  in.exceptions(std::ios::badbit);
  const json file = json::parse(in);
  all = {};
  EvaluateParams& params = all.params;
  params.protocol = file.at("protocol"), params.friction = file.at("friction");
  params.loads = file.at("loads");
  params.push_m_s2 = file.value("push_m_s2", params.push_m_s2);
  params.weight = file.value("weight", params.weight);
  params.mass_kg = file.value("mass_kg", params.mass_kg);
  params.density_kg_m3 = file.value("density_kg_m3", params.density_kg_m3);
  params.object_geometry = file.at("object_geometry"), params.control_grasps = file.at("control_grasps");
  params.self_check_trials = file.at("self_check_trials");
  params.recorded_grasps = file.at("recorded_grasps"), params.lift_grasps = file.at("lift_grasps");
  params.margin_grasps = file.at("margin_grasps"), params.margin_draws = file.at("margin_draws");
  params.seed = file.at("seed");
  all.self_check = physics::self_check_from(file.at("self_check"));
  std::ifstream recordings(dir / "recordings.json");
  recordings.exceptions(std::ios::badbit);
  all.recordings = physics::recordings_from(json::parse(recordings));
  for (const json& entry : file.at("evaluations")) all.list.push_back(evaluation_from(entry));
  all.controls = physics::controls_from(file.at("controls"));
}

}  // namespace geocage::stages
