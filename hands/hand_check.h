#pragma once
#include <string>
#include <vector>

#include "hands/hand.h"

namespace geocage::hands {

/// What is wrong or missing in a hand that loads, and what its owner should look at.
struct HandCheck {
  std::vector<std::string> problems;  ///< it won't grasp as it should until these are mended
  std::vector<std::string> notes;
};

/// Fingers without capsules, efforts or speeds, links that overlap in the open posture, fingers that open
/// when they should close, meshes that stick out of their link's capsules by more than 5 mm.
HandCheck check_hand(const Hand& hand);

/// A hand.toml to start from: each chain of joints that ends in a leaf is a finger, each link a capsule from
/// its origin to the next joint. What geocage can't know is marked with "?".
std::string draft_hand_toml(const KinematicTree& tree, const std::string& urdf_name);

}  // namespace geocage::hands
