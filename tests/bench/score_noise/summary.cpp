#include "tests/bench/score_noise/measure.h"

namespace geocage::study {
void summarise(const std::filesystem::path&) {}
}  // namespace geocage::study
