#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "cli/commands.h"
#include "cli/console.h"
#include "cli/hand_pictures.h"
#include "hands/hand_check.h"

namespace geocage::cli {

namespace fs = std::filesystem;
using nlohmann::json;

namespace {

constexpr int exit_configuration = 2;

std::string picture_of(const hands::Hand& hand, const fs::path& pictures) {
  const fs::path folder = pictures.empty() ? fs::path(GEOCAGE_DATA_DIR) / "docs/pictures/hands" : pictures;
  const fs::path file = folder / (hand.name + ".png");
  return fs::exists(file) ? file.string() : "";
}

void print_row(const hands::Hand& hand) {
  if (hand.net) {
    fmt::print("{:<18} {:>6} {:>6} {:>8} {:>8} {:>10.0f} {:>8.0f}\n", hand.name, "net", "-", "-", "-",
               1000 * hand.finger_length_m, 1000 * hand.ball_radius_m);
    return;
  }
  fmt::print("{:<18} {:>6} {:>6} {:>8} {:>8} {:>10.0f} {:>8.0f}\n", hand.name, hand.tree.moving_joints(),
             hand.tree.dofs(), hand.fingers.size(), hand.capsules.size(), 1000 * hand.finger_length_m,
             1000 * hand.ball_radius_m);
}

json to_json(const hands::Hand& hand, const fs::path& pictures) {
  const std::string picture = picture_of(hand, pictures);
  return {{"hand", hand.name},
          {"kind", hand.net ? "net" : "articulated"},
          {"joints", hand.tree.moving_joints()},
          {"dofs", hand.tree.dofs()},
          {"fingers", hand.fingers.size()},
          {"capsules", hand.capsules.size()},
          {"finger_length_m", hand.finger_length_m},
          {"ball_radius_m", hand.ball_radius_m},
          {"ball_radii_m", hand.ball_radii_m},
          {"picture", picture.empty() ? json() : json(picture)}};
}

void print_list(const std::vector<std::string>& sentences, const char* kind) {
  for (const auto& sentence : sentences) fmt::print("{}: {}\n", kind, sentence);
}

/// A URDF that has no hand.toml yet.
int check_bare_urdf(const Shared& shared, const fs::path& urdf) {
  const auto tree = hands::read_urdf(urdf);
  const std::string draft = hands::draft_hand_toml(tree, urdf.filename().string());
  const std::string problem = "there is no hand.toml beside " + urdf.string();
  if (shared.json) {
    print_json(json{{"schema", "geocage-hand-check 1"},
                    {"joints", tree.moving_joints()},
                    {"dofs", tree.dofs()},
                    {"problems", {problem}},
                    {"notes", json::array()},
                    {"draft", draft}});
  } else {
    fmt::print("The URDF is sound: {} links, {} moving joints, {} of them independent.\n", tree.links.size(),
               tree.moving_joints(), tree.dofs());
    fmt::print("missing: {}\n\nA draft of it; what geocage can't know is marked with a question mark:\n\n{}",
               problem, draft);
  }
  return exit_configuration;
}

}  // namespace

int list_hands(const Shared& shared, const fs::path& pictures) {
  std::vector<hands::Hand> all;
  for (const auto& name : hands::hand_names()) all.push_back(hands::load_hand(name));
  if (!pictures.empty()) write_hand_pictures(all, pictures);
  json list = json::array();
  if (!shared.json)
    fmt::print("{:<18} {:>6} {:>6} {:>8} {:>8} {:>10} {:>8}\n", "hand", "joints", "dofs", "fingers",
               "capsules", "finger mm", "ball mm");
  for (const hands::Hand& hand : all) {
    if (shared.json)
      list.push_back(to_json(hand, pictures));
    else
      print_row(hand);
  }
  if (shared.json)
    print_json(json{{"schema", "geocage-hands 1"}, {"hands", list}});
  else if (const std::string first = all.empty() ? "" : picture_of(all.front(), pictures); !first.empty())
    fmt::print("pictures: {}\n", fs::path(first).parent_path().string());
  return 0;
}

int check_hand(const Shared& shared, const std::string& path) {
  if (fs::path(path).extension() == ".urdf" && !fs::exists(fs::path(path).parent_path() / "hand.toml"))
    return check_bare_urdf(shared, path);
  const hands::Hand hand = hands::load_hand(path);
  const hands::HandCheck check = hands::check_hand(hand);
  if (shared.json) {
    print_json(json{{"schema", "geocage-hand-check 1"},
                    {"hand", hand.name},
                    {"joints", hand.tree.moving_joints()},
                    {"dofs", hand.tree.dofs()},
                    {"problems", check.problems},
                    {"notes", check.notes}});
  } else {
    print_list(check.problems, "problem");
    print_list(check.notes, "note");
    if (check.problems.empty()) fmt::print("{} is ready\n", hand.name);
  }
  return check.problems.empty() ? 0 : exit_configuration;
}

}  // namespace geocage::cli
