#include "physics/margins.h"
#include <nlohmann/json.hpp>

namespace geocage::physics {

using nlohmann::json;

json to_json(const Margin& margin) {
  return {
      {"level", margin.level ? json(*margin.level) : json()}, {"easy", margin.easy}, {"hard", margin.hard}};
}

Margin margin_from(const json& entry) {
  Margin margin{entry.at("easy"), entry.at("hard"), {}};
  if (!entry.at("level").is_null()) margin.level = entry.at("level").get<double>();
  return margin;
}

json to_json(const ForceMargins& margins) {
  return {{"draws", margins.draws},
          {"held", margins.held},
          {"friction", to_json(margins.friction)},
          {"push_m_s2", to_json(margins.push_m_s2)},
          {"noise", to_json(margins.noise)}};
}

ForceMargins force_margins_from(const json& entry) {
  return {entry.at("draws"), entry.at("held"), margin_from(entry.at("friction")),
          margin_from(entry.at("push_m_s2")), margin_from(entry.at("noise"))};
}

}  // namespace geocage::physics
