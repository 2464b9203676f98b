#pragma once
#include <filesystem>

#include "hands/hand.h"

namespace geocage::hands {

/// Reads a hand's folder: hand.toml, the URDF it names, and the hand it is a variant of, which lies in
/// `siblings`. Errors as load_hand.
Hand read_hand_folder(const std::filesystem::path& folder, const std::filesystem::path& siblings);

}  // namespace geocage::hands
