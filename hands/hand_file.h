#pragma once
#include <filesystem>

#include "hands/hand.h"

namespace geocage::hands {

/// Reads a hand's folder: hand.toml, the URDF it names, and the hand it is a variant of, which lies in
/// `siblings`. Errors as load_hand.
Hand read_hand_folder(const std::filesystem::path& folder, const std::filesystem::path& siblings);

/// `hands/` of the source tree, or of the folder in the environment variable GEOCAGE_DATA.
std::filesystem::path hands_folder();

}  // namespace geocage::hands
