#include "hands/hand.h"

#include <algorithm>
#include <cstdlib>

#include "hands/hand_file.h"
#include "pipeline/error.h"
#include "pipeline/nearest.h"

namespace geocage::hands {

namespace fs = std::filesystem;
using pipeline::Fault;
using pipeline::UserError;

fs::path hands_folder() {
  const char* data = std::getenv("GEOCAGE_DATA");
  return fs::path(data ? data : GEOCAGE_SOURCE_TREE) / "hands";
}

namespace {

/// The folder of hand.toml: a folder, the folder of a URDF, or a name in the project's `hands/`.
fs::path folder_of(const std::string& name_or_path) {
  const fs::path path = name_or_path;
  std::error_code error;  // a name may be too long for a file
  if (fs::is_directory(path, error) && fs::exists(path / "hand.toml")) return fs::canonical(path);
  if (path.extension() == ".urdf" && fs::exists(path, error)) return fs::canonical(path).parent_path();
  const auto known = hand_names();
  if (std::find(known.begin(), known.end(), name_or_path) != known.end())
    return hands_folder() / name_or_path;
  if (fs::is_directory(path, error))
    throw UserError(Fault::configuration, path.string(), "this folder holds no hand.toml",
                    "`geocage hands check` of a URDF that has none writes a draft");
  if (path.has_parent_path())
    throw UserError(Fault::configuration, path.string(), "this is neither a folder of a hand nor a URDF");
  const std::string near = pipeline::near_name(name_or_path, known);
  throw UserError(Fault::configuration, "hand '" + name_or_path + "'", "there is no such hand",
                  near.empty() ? "`geocage hands` lists those of " + hands_folder().string()
                               : "did you mean '" + near + "'?");
}

}  // namespace

Hand load_hand(const std::string& name_or_path) {
  return read_hand_folder(folder_of(name_or_path), hands_folder());
}

std::vector<std::string> hand_names() {
  std::vector<std::string> names;
  std::error_code missing;  // no folder, no hands
  for (const auto& entry : fs::directory_iterator(hands_folder(), missing))
    if (fs::exists(entry.path() / "hand.toml")) names.push_back(entry.path().filename().string());
  std::sort(names.begin(), names.end());
  return names;
}

void place_capsules(const Hand& hand, const Pose& X_WH, const std::vector<Pose>& X_HL,
                    std::vector<PlacedCapsule>& placed) {
  placed.resize(hand.capsules.size());
  for (std::size_t i = 0; i < placed.size(); ++i) {
    const Capsule& capsule = hand.capsules[i];
    const Pose X_WL = X_WH * X_HL[capsule.link];
    placed[i] = {X_WL * capsule.a_L, X_WL * capsule.b_L, capsule.radius_m};
  }
}

std::vector<PlacedCapsule> placed_capsules(const Hand& hand, const Pose& X_WH, const Eigen::VectorXd& q) {
  std::vector<Pose> X_HL;
  std::vector<PlacedCapsule> placed;
  forward_kinematics(hand.tree, q, X_HL);
  place_capsules(hand, X_WH, X_HL, placed);
  return placed;
}

}  // namespace geocage::hands
