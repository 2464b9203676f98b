#pragma once
#include <filesystem>

#include "hands/hand.h"

namespace geocage::cli {

/// One picture of each articulated hand in `folder`: open, and closed on a ball, a bottle and a cup.
void write_hand_pictures(const std::vector<hands::Hand>& hands, const std::filesystem::path& folder);

}  // namespace geocage::cli
