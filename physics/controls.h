#pragma once
#include <string>
#include <vector>

namespace geocage::physics {

/// A test whose answer is known. `passed` counts grasps that held in every trial.
struct Control {
  enum class Rule {
    no_trial_holds,   ///< the hand is far away
    no_grasp_passes,  ///< the fingers are open: a palm below the object may rightly hold one direction
    reported          ///< no rule: the rate of chance
  };
  std::string name;
  Rule rule = Rule::reported;
  int grasps = 0, trials = 0, held = 0, passed = 0;

  bool ok() const { return rule == Rule::reported || (rule == Rule::no_trial_holds ? held : passed) == 0; }
};

inline std::string rule_text(Control::Rule rule) {
  switch (rule) {
    case Control::Rule::no_trial_holds:
      return "no trial may hold";
    case Control::Rule::no_grasp_passes:
      return "no grasp may hold in every trial";
    case Control::Rule::reported:
      break;
  }
  return "the rate of chance";
}

}  // namespace geocage::physics
