#pragma once
#include <string>
#include <string_view>
#include <vector>

namespace geocage::stages {

/// How the world is integrated: the same for every body in it.
struct Engine {
  double dt_s = 1e-3;
  int iterations = 50;
  double friction = 0.6;             ///< Coulomb's mu of a contact; each body carries its square root
  double contact_m = 1e-3;           ///< contacts are made from this gap on
  double way_out_m_s = 0.02;         ///< fastest that a penetration is undone
  double hand_density_kg_m3 = 2000;  ///< links weigh as their capsules do
};

/// How the motors hold the fingers. A target farther than speed/gain asks for the whole speed.
struct Grip {
  double torque_limit_nm = 0.5, force_limit_n = 20;      ///< revolute, prismatic joints
  double squeeze_rad = 0.1, squeeze_m = 0.005;           ///< target beyond the grasp's posture, along closing
  double speed_limit_rad_s = 1, speed_limit_m_s = 0.05;  ///< of the velocity that the position error asks for
  double gain_1ps = 10;                                  ///< asked velocity per position error
};

/// A named force test: every number that its outcome depends on.
struct Protocol {
  std::string name;
  Engine engine;
  Grip grip;
  double mass_kg = 0.1;
  double acceleration_m_s2 = 10;
  double settle_s = 1, push_s = 2;
  double max_translation_m = 0.05, max_rotation_rad = 0.2617993877991494;  ///< held below both
  double max_drift_m = 0.01, max_drift_rad = 0.2617993877991494;           ///< while settling
  double max_penetration_m = 0.01;                                         ///< at the start; then growth
  double max_speed_m_s = 20;                                           ///< beyond it the engine has failed
  double rest_s = 0.2, rest_speed_m_s = 1e-3, rest_spin_rad_s = 0.01;  ///< a phase ends early at rest
};

/// UserError (configuration) with the known names.
const Protocol& find_protocol(std::string_view name);
std::vector<std::string> protocol_names();

}  // namespace geocage::stages
