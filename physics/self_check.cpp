#include "physics/self_check.h"

#include <algorithm>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace geocage::physics {

using nlohmann::json;

void SelfCheck::count(const std::string& trial, Outcome outcome, Outcome at_half_step,
                      Outcome at_twice_iterations) {
  ++trials;
  half_step += at_half_step == outcome;
  twice_iterations += at_twice_iterations == outcome;
  if (at_half_step != outcome)
    disagreements.push_back(
        fmt::format("{}: {}, but {} at half the step", trial, name(outcome), name(at_half_step)));
  if (at_twice_iterations != outcome)
    disagreements.push_back(fmt::format("{}: {}, but {} with twice the iterations", trial, name(outcome),
                                        name(at_twice_iterations)));
}

std::string SelfCheck::text() const {
  return fmt::format("half step {} of {}, twice the iterations {} of {}", half_step, trials, twice_iterations,
                     trials);
}

std::vector<std::size_t> even_sample(std::size_t all, int wanted) {
  const std::size_t count = std::min(all, static_cast<std::size_t>(std::max(wanted, 0)));
  std::vector<std::size_t> sample;
  for (std::size_t i = 0; i < count; ++i) sample.push_back(i * all / count);
  return sample;
}

json to_json(const SelfCheck& check) {
  return {{"trials", check.trials},
          {"agree_at_half_step", check.half_step},
          {"agree_with_twice_iterations", check.twice_iterations},
          {"disagreements", check.disagreements}};
}

SelfCheck self_check_from(const json& entry) {
  return {entry.at("trials"), entry.at("agree_at_half_step"), entry.at("agree_with_twice_iterations"),
          entry.at("disagreements")};
}

}  // namespace geocage::physics
