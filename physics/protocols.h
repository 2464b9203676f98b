#pragma once
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace geocage::physics {

/// How the world of a force test is integrated: the same for every body in it.
struct Engine {
  double dt_s = 1e-3;
  int iterations = 50;
  double friction = 0.6;  ///< Coulomb's mu of a contact; each body carries its square root
  /// The torsion about its normal that a contact resists, over its force; unset: mu times the hand's own
  /// `torsion_m`. Limited apart from the sliding friction.
  std::optional<double> torsional_m;
  double contact_m = 1e-3;           ///< contacts are made from this gap on
  double way_out_m_s = 0.02;         ///< fastest that a penetration is undone
  double hand_density_kg_m3 = 2000;  ///< links weigh as their capsules do
  double linear_damping_1ps = 0;     ///< the object's velocity shrinks by exp(-damping dt) a step
  double angular_damping_1ps = 0;
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
  std::string source;  ///< where the numbers come from, and which of them are ours
  Engine engine;
  Grip grip;
  double mass_kg = 0.1;
  std::optional<double> density_kg_m3;  ///< of the solid, instead of the mass
  double acceleration_m_s2 = 10;
  double settle_s = 1, push_s = 2;
  double max_translation_m = 0.05, max_rotation_rad = 0.2617993877991494;  ///< held below both
  bool contact_holds = false;  ///< instead: held while the object and the hand touch when the push ends
  double max_drift_m = 0.01, max_drift_rad = 0.2617993877991494;  ///< while settling
  double max_start_penetration_m = 0.01;                          ///< rejected above
  double max_penetration_growth_m = 0.01;  ///< beyond the start's the engine has failed
  double max_speed_m_s = 20;               ///< likewise
  double rest_s = 0.2, rest_speed_m_s = 1e-3,
         rest_spin_rad_s = 0.01;  ///< a phase ends early at rest; 0 s: never
};

/// How the object of a cage test moves.
struct CageEngine {
  double dt_s = 1.0 / 240;
  double most_motion_m = 3e-3;  ///< of the object's surface in a step: a faster object takes shorter steps,
  int most_parts = 24;          ///< at most so many in dt
  int iterations = 400;         ///< at most: they end once no contact changes its speed by more than 1 um/s
  double way_out_m_s = 0.02;    ///< fastest that a penetration is undone
  double contact_m = 1e-3;      ///< contacts are made from this gap on, plus what a step may close
  double damping_s = 0.02;      ///< v' = F / m - v / damping_s, exact in a step of any length; 0: no damping
  bool axis_locked = false;     ///< no translation along z of W
};

/// The cage test: locked fingers, no friction. Only geometry holds.
struct CageProtocol {
  std::string name = "geocage-cage";
  CageEngine engine;
  double mass_kg = 0.1, gravity_m_s2 = 10;
  double pull_s = 5;  ///< gravity along an axis, and in the plane of the ring
  double wrench_s = 10, wrench_hold_s = 0.1;
  double max_start_penetration_m = 0.01;
  double max_speed_m_s = 20, max_penetration_m = 5e-3;  ///< beyond either the engine has failed
  double rest_s = 0.2, rest_speed_m_s = 1e-3, rest_spin_rad_s = 0.01;  ///< a pull ends early at rest
};

/// The same test at half the step: half of dt, and half of what a step may move.
CageProtocol at_half_step(CageProtocol protocol);

/// UserError (configuration) with the known names.
const Protocol& find_protocol(std::string_view name);
std::vector<std::string> protocol_names();

}  // namespace geocage::physics
