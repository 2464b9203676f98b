#include "physics/controls.h"
#include <nlohmann/json.hpp>

namespace geocage::physics {

using nlohmann::json;

json to_json(const std::vector<Control>& controls) {
  json list = json::array();
  for (const Control& control : controls)
    list.push_back({{"name", control.name},
                    {"rule", rule_text(control.rule)},
                    {"grasps", control.grasps},
                    {"trials", control.trials},
                    {"held", control.held},
                    {"passed", control.passed},
                    {"ok", control.ok()}});
  return list;
}

std::vector<Control> controls_from(const json& list) {
  using Rule = Control::Rule;
  std::vector<Control> controls;
  for (const json& entry : list) {
    Control& control = controls.emplace_back();
    control.name = entry.at("name");
    control.grasps = entry.at("grasps"), control.trials = entry.at("trials");
    control.held = entry.at("held"), control.passed = entry.at("passed");
    for (const Rule rule : {Rule::no_trial_holds, Rule::no_grasp_passes, Rule::all_trials_hold})
      if (entry.at("rule") == rule_text(rule)) control.rule = rule;
  }
  return controls;
}

}  // namespace geocage::physics
