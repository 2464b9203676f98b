#include "reports/results.h"

#include <algorithm>
#include <fstream>
#include <limits>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "pipeline/error.h"

namespace geocage::reports {

namespace fs = std::filesystem;
using nlohmann::json;

namespace {

json read_json(const fs::path& file, const std::string& schema) {
  std::ifstream in(file);
  try {
    json content = json::parse(in);
    if (content.at("schema") == schema) return content;
  } catch (const json::exception&) {  // told below
  }
  throw pipeline::UserError(pipeline::Fault::store, file.string(),
                            "this is not a file of schema '" + schema + "'", "run `geocage verify`");
}

/// A number, which a file writes as null when it is none.
double number(const json& object, const char* key) {
  const auto entry = object.find(key);
  return entry == object.end() || !entry->is_number() ? std::numeric_limits<double>::quiet_NaN()
                                                      : entry->get<double>();
}

EvaluationResult evaluation_from(const json& entry) {
  EvaluationResult result;
  result.grasp = entry.at("grasp");
  result.outcome = entry.at("outcome");
  result.reason = entry.at("reason");
  result.drift_m = number(entry, "drift_m");
  result.drift_rad = number(entry, "drift_rad");
  result.held_within_2_cm = entry.at("held_within_2_cm");
  const json& summary = entry.at("summary");
  if (summary.at("worst").is_string()) result.worst = summary.at("worst");
  if (summary.at("fall_s").is_number()) result.fall_s = summary.at("fall_s").get<double>();
  for (const json& direction : entry.at("directions"))
    result.directions.push_back({direction.at("name"), direction.at("held"), direction.at("held_within_2_cm"),
                                 number(direction, "max_displacement_m"),
                                 number(direction, "max_rotation_rad")});
  if (const auto lift = entry.find("lift"); lift != entry.end() && !lift->is_null())
    result.lift = {lift->at("outcome"), lift->at("phase"), lift->at("released")};
  return result;
}

std::vector<ControlResult> controls_from(const json& list) {
  std::vector<ControlResult> controls;
  for (const json& control : list)
    controls.push_back({control.at("name"), control.at("rule"), control.at("grasps"), control.at("trials"),
                        control.at("held"), control.at("passed"), control.at("ok")});
  return controls;
}

int held_of(const json& pulls) {
  return static_cast<int>(
      std::ranges::count_if(pulls, [](const json& pull) { return pull.at("held").get<bool>(); }));
}

}  // namespace

int Evaluations::held() const {
  return static_cast<int>(std::ranges::count(grasps, "held", &EvaluationResult::outcome));
}

int Evaluations::held_within_2_cm() const {
  return static_cast<int>(std::ranges::count(grasps, true, &EvaluationResult::held_within_2_cm));
}

bool Evaluations::valid() const {
  return std::ranges::all_of(controls, &ControlResult::ok);
}

bool Cages::valid() const {
  return std::ranges::all_of(controls, &ControlResult::ok);
}

Cages read_cages(const fs::path& folder) {
  const json file = read_json(folder / "cages.json", "geocage-cages 1");
  Cages all;
  all.controls = controls_from(file.at("controls"));
  for (const json& entry : file.at("evaluations")) {
    CageResult& cage = all.grasps.emplace_back();
    cage.grasp = entry.at("grasp");
    cage.outcome = entry.at("outcome"), cage.reason = entry.at("reason");
    cage.search = entry.at("escape_search").at("result");
    cage.searches_found = entry.at("escape_search").at("found");
    const auto rises = entry.at("escape_search").at("rise_m").get<std::vector<double>>();
    if (!rises.empty()) cage.rise_m = std::ranges::min(rises);
    cage.compliant = static_cast<int>(entry.at("compliant").size()),
    cage.compliant_retained = held_of(entry.at("compliant"));
    cage.pulls = static_cast<int>(entry.at("directions").size()),
    cage.pulls_retained = held_of(entry.at("directions"));
    cage.ring = static_cast<int>(entry.at("ring").size()), cage.ring_retained = held_of(entry.at("ring"));
    for (const json& wrench : entry.at("wrenches")) {
      cage.wrenches += wrench.at("trials").get<int>(), cage.wrenches_lost += wrench.at("lost").get<int>();
      cage.amplitudes.push_back(
          {number(wrench, "amplitude_weights"), number(wrench, "survival"), number(wrench, "mean_held_s")});
    }
    std::ranges::sort(cage.amplitudes, {}, &WrenchResult::weights);
    if (const json& half = entry.at("a_50"); !half.is_null()) {
      const double weights = half.at("weights");
      const std::string is = half.at("is");
      if (is == "at") cage.half_weights = weights;
      cage.half = (is == "at" ? "" : is + " ") + fmt::format("{:.3g}", weights);
    }
  }
  return all;
}

Evaluations read_evaluations(const fs::path& folder) {
  const json file = read_json(folder / "evaluations.json", "geocage-evaluations 1");
  Evaluations all;
  all.protocol = file.at("protocol");
  all.object_geometry = file.at("object_geometry");
  all.counts = file.at("counts");
  all.controls = controls_from(file.at("controls"));
  for (const json& entry : file.at("evaluations")) {
    all.grasps.push_back(evaluation_from(entry));
    if (!all.engine.empty()) continue;
    for (const auto& [key, value] : entry.at("engine").items())
      all.engine.emplace_back(key, value.is_string() ? value.get<std::string>() : value.dump());
  }
  return all;
}

std::vector<Approach> read_approaches(const fs::path& folder) {
  std::vector<Approach> approaches;
  for (;;) {
    const fs::path file = folder / ("trajectory_" + std::to_string(approaches.size()) + ".json");
    if (!fs::exists(file)) return approaches;
    const json way = read_json(file, "geocage-trajectory 1");
    const auto steps = way.at("q_rad").size();
    approaches.push_back({way.value("outcome", "planned"),
                          steps > 1 ? static_cast<double>(steps - 1) * number(way, "dt_s") : 0,
                          number(way, "min_clearance_m"), way.at("certified")});
  }
}

}  // namespace geocage::reports
