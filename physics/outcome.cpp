#include "physics/outcome.h"

#include <cstdlib>

namespace geocage::physics {

std::string_view name(Outcome outcome) {
  switch (outcome) {
    case Outcome::held:
      return "held";
    case Outcome::lost:
      return "lost";
    case Outcome::rejected:
      return "rejected";
    case Outcome::unsettled:
      return "unsettled";
    case Outcome::error:
      return "error";
  }
  std::abort();
}

}  // namespace geocage::physics
