#pragma once
#include <string>
#include <vector>

#include "physics/protocols.h"
#include <nlohmann/json_fwd.hpp>

namespace geocage::physics {

/// A test whose answer is known. `passed` counts grasps that held in every trial.
struct Control {
  enum class Rule {
    no_trial_holds,   ///< the hand is far away
    no_grasp_passes,  ///< the fingers are open: a palm below the object may rightly hold one direction
    all_trials_hold,  ///< there is no way out
    reported          ///< no rule: the rate of chance
  };
  std::string name;
  Rule rule = Rule::reported;
  int grasps = 0, trials = 0, held = 0, passed = 0;

  bool ok() const;
};
std::string rule_text(Control::Rule rule);

/// As evaluation files hold them.
nlohmann::json to_json(const std::vector<Control>& controls);
std::vector<Control> controls_from(const nlohmann::json& list);

/// Cages that are known, under this protocol: a ball in a box of six thick capsules with 0.5 mm of play
/// (stays, also under random wrenches of 1 and 5 weights and so many seeds), a ring on a bar with end stops
/// (stays), and along a bar without them (leaves).
std::vector<Control> known_cages(const CageProtocol& protocol, int seeds);

/// The same for a force test, without friction: the walls are capsules of a hand without joints, and the
/// ring's play of 5 mm is below any protocol's limits. Six pushes each, along the bare bar two.
std::vector<Control> known_cages(const Protocol& protocol);

}  // namespace geocage::physics
