#pragma once
#include <cstddef>
#include <string>
#include <vector>

#include "physics/outcome.h"
#include <nlohmann/json_fwd.hpp>

namespace geocage::physics {

/// Trials that were repeated with half the time step, and with twice the solver's iterations: how many had
/// the same outcome. An engine whose answer hangs on either says little.
struct SelfCheck {
  int trials = 0, half_step = 0, twice_iterations = 0;  ///< sampled; of those, with the same outcome
  std::vector<std::string> disagreements;  ///< "grasp 3, push +x: held, but lost at half the step"

  void count(const std::string& trial, Outcome outcome, Outcome at_half_step, Outcome at_twice_iterations);
  /// "half step 12 of 12, twice the iterations 12 of 12".
  std::string text() const;
};

/// `wanted` of `all` indices, evenly spread, ascending; all when there are fewer.
std::vector<std::size_t> even_sample(std::size_t all, int wanted);

nlohmann::json to_json(const SelfCheck& check);
SelfCheck self_check_from(const nlohmann::json& entry);

}  // namespace geocage::physics
