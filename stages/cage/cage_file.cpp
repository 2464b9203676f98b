#include <fstream>

#include <nlohmann/json.hpp>

#include "pipeline/error.h"
#include "pipeline/text_file.h"
#include "stages/cage/cage.h"

namespace geocage::stages {
namespace {

using nlohmann::json;
using physics::EscapeSearch;
using physics::Outcome;

Outcome outcome_named(const std::string& text) {
  for (const Outcome outcome : physics::outcomes)
    if (physics::name(outcome) == text) return outcome;
  throw pipeline::UserError(pipeline::Fault::store, "cages.json", "unknown outcome '" + text + "'",
                            "run `geocage verify`");
}

constexpr std::pair<EscapeSearch::Result, const char*> results[] = {
    {EscapeSearch::Result::found, "found"},
    {EscapeSearch::Result::not_found, "not found"},
    {EscapeSearch::Result::stuck, "stuck"}};

json pulls_json(const std::vector<CagePull>& pulls) {
  json list = json::array();
  for (const CagePull& pull : pulls)
    list.push_back({{"name", pull.name},
                    {"held", pull.outcome == Outcome::held},
                    {"outcome", physics::name(pull.outcome)},
                    {"max_displacement_m", pull.max_displacement_m},
                    {"max_rotation_rad", pull.max_rotation_rad},
                    {"ended_s", pull.ended_s}});
  return list;
}

std::vector<CagePull> pulls_from(const json& list) {
  std::vector<CagePull> pulls;
  for (const json& entry : list)
    pulls.push_back({entry.at("name"), outcome_named(entry.at("outcome")), entry.at("max_displacement_m"),
                     entry.at("max_rotation_rad"), entry.at("ended_s")});
  return pulls;
}

json search_json(const EscapeSearch& search) {
  json entry = {{"samples", search.samples}, {"path_m", search.path_m}, {"deepest_m", search.deepest_m},
                {"seeds", search.seeds},     {"found", search.found},   {"rise_m", search.rise_m}};
  if (!search.unfound_rise_m.empty()) entry["unfound_rise_m"] = search.unfound_rise_m;
  for (const auto& [result, text] : results)
    if (search.result == result) entry["result"] = text;
  json path = json::array();
  for (const auto& X_WO : search.path_WO) path.push_back(hands::to_json(X_WO));
  entry["X_WO"] = path;
  return entry;
}

EscapeSearch search_from(const json& entry) {
  EscapeSearch search;
  for (const auto& [result, text] : results)
    if (entry.at("result") == text) search.result = result;
  search.samples = entry.at("samples"), search.path_m = entry.at("path_m"),
  search.deepest_m = entry.at("deepest_m");
  search.seeds = entry.at("seeds"), search.found = entry.at("found");
  search.rise_m = entry.at("rise_m").get<std::vector<double>>();
  if (entry.contains("unfound_rise_m"))
    search.unfound_rise_m = entry["unfound_rise_m"].get<std::vector<double>>();
  for (const json& pose : entry.at("X_WO"))
    search.path_WO.push_back(hands::pose_from_json(pose, "cages.json"));
  return search;
}

json wrenches_json(const std::vector<CageWrench>& wrenches) {
  json list = json::array();
  for (const CageWrench& wrench : wrenches) {
    json curve = json::array();
    for (const physics::SurvivalStep& step : wrench.curve) curve.push_back({step.time_s, step.share});
    list.push_back({{"amplitude_weights", wrench.amplitude},
                    {"trials", wrench.trials},
                    {"lost", wrench.lost},
                    {"errors", wrench.errors},
                    {"survival", wrench.survival},
                    {"mean_held_s", wrench.mean_held_s},
                    {"curve_s_share", curve}});
  }
  return list;
}

std::vector<CageWrench> wrenches_from(const json& list) {
  std::vector<CageWrench> wrenches;
  for (const json& entry : list) {
    wrenches.push_back({entry.at("amplitude_weights"),
                        entry.at("trials"),
                        entry.at("lost"),
                        entry.at("errors"),
                        entry.at("survival"),
                        entry.at("mean_held_s"),
                        {}});
    for (const json& step : entry.at("curve_s_share"))
      wrenches.back().curve.push_back({step.at(0), step.at(1)});
  }
  return wrenches;
}

json loosening_json(const std::vector<physics::Loosening>& all) {
  json list = json::array();
  for (const physics::Loosening& one : all)
    list.push_back({{"finger", one.finger}, {"share", physics::to_json(one.share)}});
  return list;
}

std::vector<physics::Loosening> loosening_from(const json& list) {
  std::vector<physics::Loosening> all;
  for (const json& entry : list) all.push_back({entry.at("finger"), physics::margin_from(entry.at("share"))});
  return all;
}

json engine_json(const CageParams& params) {
  const physics::CageProtocol protocol;
  const physics::CageEngine& engine = protocol.engine;
  return {{"name", "Bullet"},
          {"version", "3.24, double precision"},
          {"stage_version", cage_stage.version},
          {"object_geometry", params.object_geometry},
          {"object_shape", "signed distance field against capsules"},
          {"hand", "locked: capsules that never move"},
          {"dt_s", params.step_s},
          {"most_motion_m", engine.most_motion_m},
          {"most_parts", engine.most_parts},
          {"iterations", engine.iterations},
          {"way_out_m_s", engine.way_out_m_s},
          {"contact_m", engine.contact_m},
          {"damping_s", params.damping_s},
          {"mu", 0},
          {"mass_kg", protocol.mass_kg},
          {"gravity_m_s2", protocol.gravity_m_s2},
          {"pull_s", protocol.pull_s},
          {"wrench_s", protocol.wrench_s},
          {"wrench_hold_s", protocol.wrench_hold_s},
          {"max_start_penetration_m", protocol.max_start_penetration_m},
          {"max_penetration_growth", "half of the thinnest capsule's radius"}};
}

json counts_json(const std::vector<CageEvaluation>& list) {
  json counts;
  for (const Outcome outcome : physics::outcomes)
    counts[std::string(physics::name(outcome))] = std::ranges::count(list, outcome, &CageEvaluation::outcome);
  return counts;
}

}  // namespace

json to_json(const CageEvaluations& all, const CageEvaluation& evaluation) {
  return {{"schema", "geocage-evaluation 1"},
          {"grasp", evaluation.grasp},
          {"protocol", physics::CageProtocol{}.name},
          {"outcome", physics::name(evaluation.outcome)},
          {"reason", evaluation.reason},
          {"directions", pulls_json(evaluation.pulls)},
          {"ring", pulls_json(evaluation.ring)},
          {"compliant", pulls_json(evaluation.compliant)},
          {"wrenches", wrenches_json(evaluation.wrenches)},
          {"a_50", physics::to_json(evaluation.half)},
          {"escape_search", search_json(evaluation.search)},
          {"loosening", loosening_json(evaluation.loosening)},
          {"start_penetration_m", evaluation.start_penetration_m},
          {"max_penetration_m", evaluation.max_penetration_m},
          {"backed_off_m", evaluation.backed_off_m},
          {"counts", counts_json({evaluation})},
          {"engine", engine_json(all.params)},
          {"seed", all.params.seed}};
}

std::string_view artefact_kind(const CageEvaluations*) {
  return "cages";
}

void save_artefact(const CageEvaluations& all, const std::filesystem::path& dir) {
  json entries = json::array();
  for (const CageEvaluation& evaluation : all.list) entries.push_back(to_json(all, evaluation));
  const CageParams& params = all.params;
  const json file = {{"schema", "geocage-cages 1"},
                     {"object_geometry", params.object_geometry},
                     {"wrench_amplitudes", params.wrench_amplitudes},
                     {"wrench_seeds", params.wrench_seeds},
                     {"search_samples", params.search_samples},
                     {"search_seeds", params.search_seeds},
                     {"compliant_grasps", params.compliant_grasps},
                     {"damping_s", params.damping_s},
                     {"step_s", params.step_s},
                     {"control_grasps", params.control_grasps},
                     {"self_check_trials", params.self_check_trials},
                     {"recorded_grasps", params.recorded_grasps},
                     {"margin_grasps", params.margin_grasps},
                     {"seed", params.seed},
                     {"counts", counts_json(all.list)},
                     {"controls", physics::to_json(all.controls)},
                     {"valid", all.valid()},
                     {"self_check", physics::to_json(all.self_check)},
                     {"evaluations", entries}};
  pipeline::write_text(dir / "cages.json", file.dump(1) + "\n");
  pipeline::write_text(dir / "recordings.json", physics::to_json(all.recordings).dump() + "\n");
}

void load_artefact(CageEvaluations& all, const std::filesystem::path& dir) {
  std::ifstream in(dir / "cages.json");
  in.exceptions(std::ios::badbit);
  const json file = json::parse(in);
  all = {};
  CageParams& params = all.params;
  params.object_geometry = file.at("object_geometry");
  params.wrench_amplitudes = file.at("wrench_amplitudes").get<std::vector<double>>();
  params.wrench_seeds = file.at("wrench_seeds"), params.search_samples = file.at("search_samples");
  params.search_seeds = file.at("search_seeds"), params.compliant_grasps = file.at("compliant_grasps");
  params.damping_s = file.at("damping_s"), params.step_s = file.at("step_s");
  params.control_grasps = file.at("control_grasps"), params.seed = file.at("seed");
  params.self_check_trials = file.at("self_check_trials");
  params.recorded_grasps = file.at("recorded_grasps"), params.margin_grasps = file.at("margin_grasps");
  all.controls = physics::controls_from(file.at("controls"));
  all.self_check = physics::self_check_from(file.at("self_check"));
  std::ifstream recordings(dir / "recordings.json");
  recordings.exceptions(std::ios::badbit);
  all.recordings = physics::recordings_from(json::parse(recordings));
  for (const json& entry : file.at("evaluations")) {
    CageEvaluation& evaluation = all.list.emplace_back();
    evaluation.grasp = entry.at("grasp"), evaluation.outcome = outcome_named(entry.at("outcome"));
    evaluation.reason = entry.at("reason");
    evaluation.start_penetration_m = entry.at("start_penetration_m");
    evaluation.max_penetration_m = entry.at("max_penetration_m");
    evaluation.backed_off_m = entry.at("backed_off_m");
    evaluation.pulls = pulls_from(entry.at("directions")), evaluation.ring = pulls_from(entry.at("ring"));
    evaluation.compliant = pulls_from(entry.at("compliant"));
    evaluation.wrenches = wrenches_from(entry.at("wrenches"));
    evaluation.half = physics::half_amplitude_from(entry.at("a_50"));
    evaluation.search = search_from(entry.at("escape_search"));
    evaluation.loosening = loosening_from(entry.at("loosening"));
  }
}

}  // namespace geocage::stages
