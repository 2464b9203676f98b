#pragma once
#include <filesystem>

#include "hands/hand.h"

namespace geocage::cli {

/// One picture of each hand in `folder`: open, and closed on a ball, a bottle and a cup; of a net: laid on
/// the ball, and drawn tight on the three.
void write_hand_pictures(const std::vector<hands::Hand>& hands, const std::filesystem::path& folder);

}  // namespace geocage::cli
