#include "cli/parameters.h"

#include <algorithm>

namespace geocage::cli {

std::vector<std::string> stage_names() {
  StageParameters parameters;
  std::vector<std::string> names;
  for_each_stage(parameters, [&](const char* name, auto&&...) { names.emplace_back(name); });
  return names;
}

pipeline::Fields fields_of_stage(StageParameters& parameters, const std::string& stage) {
  pipeline::Fields fields;
  bool known = false;
  for_each_stage(parameters, [&](const char* name, int, const char*, auto& params) {
    if (stage != name) return;
    known = true;
    params.visit(fields);
  });
  if (!known)
    throw pipeline::UserError(pipeline::Fault::configuration, stage,
                              "there is no such stage" + pipeline::did_you_mean(stage, stage_names()),
                              "geocage stages lists them");
  return fields;
}

void apply_all(const std::vector<pipeline::Setting>& settings, StageParameters& parameters,
               std::vector<std::string>& mistakes) {
  const auto known = stage_names();
  for (const auto& setting : settings) {
    if (std::count(known.begin(), known.end(), setting.stage) == 0)
      mistakes.push_back(pipeline::mistake(
          setting.where, "",
          "unknown stage '" + setting.stage + "'" + pipeline::did_you_mean(setting.stage, known)));
    else
      pipeline::apply(setting, fields_of_stage(parameters, setting.stage), mistakes);
  }
}

}  // namespace geocage::cli
