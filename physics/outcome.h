#pragma once
#include <string_view>

namespace geocage::physics {

/// What a test showed. All five count in the denominator of a rate.
enum class Outcome {
  held,       ///< no load moved the object past the limits
  lost,       ///< at least one did
  rejected,   ///< not simulated: the reason says why
  unsettled,  ///< the closing hand moved the object past the limits before any load
  error       ///< the engine failed: NaN, absurd speed or growing penetration
};
inline constexpr Outcome outcomes[] = {Outcome::held, Outcome::lost, Outcome::rejected, Outcome::unsettled,
                                       Outcome::error};
std::string_view name(Outcome outcome);

}  // namespace geocage::physics
