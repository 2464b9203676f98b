#include "physics/protocols.h"

#include <algorithm>
#include <limits>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "pipeline/error.h"

namespace geocage::physics {
namespace {

constexpr double any = std::numeric_limits<double>::infinity();

Protocol geocage_force() {
  Protocol p;
  p.name = "geocage-force";
  p.source = "geocage";
  return p;
}

// The limits of BODex; geocage-force differs by its settling rule only.
Protocol bodex() {
  Protocol p;
  p.name = "bodex";
  p.source =
      "BODex / DexGraspBench: 0.1 kg, mu 0.6, 10 m/s^2 for 2 s, 5 cm and 15 deg, 10 mm at the start; "
      "torsional friction 0.02 m; motors, squeeze and time step are geocage's";
  p.engine.torsional_m = 0.02;
  p.max_drift_m = p.max_translation_m, p.max_drift_rad = p.max_rotation_rad;
  return p;
}

Protocol dexgraspnet() {
  Protocol p;
  p.name = "dexgraspnet";
  p.source =
      "DexGraspNet: 500 kg/m^3, mu 3, 9.8 m/s^2 for 100 steps of 1/60 s, any contact left, 1 mm at the "
      "start; "
      "motors, squeeze and time step are geocage's";
  p.engine.friction = 3, p.engine.torsional_m = 0;
  p.density_kg_m3 = 500;
  p.acceleration_m_s2 = 9.8;
  p.settle_s = 0, p.push_s = 100.0 / 60;
  p.max_translation_m = p.max_rotation_rad = any, p.contact_holds = true;
  p.max_start_penetration_m = 0.001;
  p.rest_s = 0;
  return p;
}

Protocol multidex() {
  Protocol p;
  p.name = "multidex";
  p.source =
      "MultiDex / GenDexGrasp: 10,000 kg/m^3, mu 10, 0.5 m/s^2 for 50 steps of 1/60 s, 2 cm, damping 10 and "
      "100 1/s; "
      "motors, squeeze and time step are geocage's";
  p.engine.friction = 10, p.engine.torsional_m = 0;
  p.engine.linear_damping_1ps = 10, p.engine.angular_damping_1ps = 100;
  p.density_kg_m3 = 10000;
  p.acceleration_m_s2 = 0.5;
  p.settle_s = 0, p.push_s = 50.0 / 60;
  p.max_translation_m = 0.02, p.max_rotation_rad = any;
  p.rest_s = 0;
  return p;
}

const std::vector<Protocol>& presets() {
  static const std::vector<Protocol> table = {geocage_force(), bodex(), dexgraspnet(), multidex()};
  return table;
}

}  // namespace

std::vector<std::string> protocol_names() {
  std::vector<std::string> names;
  for (const Protocol& preset : presets()) names.push_back(preset.name);
  return names;
}

CageProtocol at_half_step(CageProtocol protocol) {
  protocol.engine.dt_s /= 2;
  protocol.engine.most_motion_m /= 2;
  return protocol;
}

const Protocol& find_protocol(std::string_view name) {
  const auto found = std::ranges::find(presets(), name, &Protocol::name);
  if (found != presets().end()) return *found;
  throw pipeline::UserError(pipeline::Fault::configuration, "evaluate.protocol",
                            fmt::format("there is no protocol '{}'", name),
                            fmt::format("known: {}", fmt::join(protocol_names(), ", ")));
}

}  // namespace geocage::physics
