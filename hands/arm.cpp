#include "hands/arm.h"

#include <algorithm>
#include <filesystem>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <toml++/toml.h>

#include "hands/hand_file.h"
#include "hands/toml_table.h"
#include "pipeline/error.h"

namespace geocage::hands {

namespace fs = std::filesystem;
using pipeline::Fault;
using pipeline::UserError;

namespace {

fs::path folder_of(const std::string& name_or_path) {
  if (fs::exists(fs::path(name_or_path) / "arm.toml")) return name_or_path;
  fs::path known = hands_folder() / "arms" / name_or_path;
  if (!name_or_path.empty() && fs::exists(known / "arm.toml")) return known;
  throw UserError(Fault::configuration, "arm '" + name_or_path + "'", "there is no such arm",
                  fmt::format("known: {}", fmt::join(arm_names(), ", ")));
}

}  // namespace

std::vector<std::string> arm_names() {
  std::vector<std::string> names;
  std::error_code missing;  // no folder, no arms
  for (const auto& entry : fs::directory_iterator(hands_folder() / "arms", missing))
    if (fs::exists(entry.path() / "arm.toml")) names.push_back(entry.path().filename().string());
  std::sort(names.begin(), names.end());
  return names;
}

Arm load_arm(const std::string& name_or_path) {
  const fs::path folder = folder_of(name_or_path), file = folder / "arm.toml";
  const toml::table parsed = toml_of(file);
  TomlTable table(parsed);
  Arm arm;
  arm.name = fs::path(folder).filename().string();
  arm.tree = read_urdf(folder / table.get<std::string>("urdf"));
  arm.flange = table.get<std::string>("flange");
  table.index("flange", arm.flange, [&](const std::string& name) { return arm.tree.link(name); });
  arm.X_FH.translation() = table.vector("hand_at_m");
  const auto rest = table.list<double>("rest_rad");
  if (static_cast<int>(rest.size()) != arm.tree.dofs())
    table.wrong("rest_rad", "has not one entry for each joint");
  arm.rest_rad = Eigen::Map<const Eigen::VectorXd>(rest.data(), arm.tree.dofs());
  for (TomlTable row : table.tables("capsule")) {
    Capsule capsule;
    capsule.link = row.index("link", row.get<std::string>("link"),
                             [&](const std::string& name) { return arm.tree.link(name); });
    capsule.a_L = row.vector("a_m");
    capsule.b_L = row.vector("b_m");
    capsule.radius_m = row.length("radius_m");
    row.end();
    arm.capsules.push_back(capsule);
  }
  table.end();
  return arm;
}

namespace {

Eigen::VectorXd joined(const Eigen::VectorXd& a, const Eigen::VectorXd& b) {
  Eigen::VectorXd both(a.size() + b.size());
  both << a, b;
  return both;
}

std::vector<std::string> joined(std::vector<std::string> names, const std::vector<std::string>& more) {
  const auto own = names;
  for (const auto& name : more)
    names.push_back(std::count(own.begin(), own.end(), name) > 0 ? "hand/" + name : name);
  return names;
}

}  // namespace

ArmedHand on_arm(const Arm& arm, const Hand& hand) {
  ArmedHand armed;
  armed.arm_dofs = arm.tree.dofs();
  armed.hand_link = static_cast<int>(arm.tree.links.size());
  const int shift = armed.hand_link, dofs = armed.arm_dofs;
  Hand& body = armed.body;
  body = hand;
  body.name = arm.name + "+" + hand.name;
  KinematicTree& tree = body.tree;
  tree = arm.tree;
  tree.links = joined(tree.links, hand.tree.links);
  tree.dof_names = joined(tree.dof_names, hand.tree.dof_names);
  tree.lower_rad = joined(tree.lower_rad, hand.tree.lower_rad);
  tree.upper_rad = joined(tree.upper_rad, hand.tree.upper_rad);
  tree.velocity_limit_rad_s = joined(tree.velocity_limit_rad_s, hand.tree.velocity_limit_rad_s);
  tree.effort_limit_nm = joined(tree.effort_limit_nm, hand.tree.effort_limit_nm);
  Joint mount;
  mount.name = "mount";
  mount.parent_link = arm.tree.link(arm.flange);
  mount.child_link = shift;
  mount.X_PJ = arm.X_FH;
  tree.joints.push_back(mount);
  for (Joint joint : hand.tree.joints) {
    joint.parent_link += shift;
    joint.child_link += shift;
    joint.dof += dofs;
    tree.joints.push_back(joint);
  }
  for (LinkMesh mesh : hand.tree.meshes) {
    mesh.link += shift;
    tree.meshes.push_back(mesh);
  }
  body.capsules = arm.capsules;
  for (Capsule capsule : hand.capsules) {
    capsule.link += shift;
    body.capsules.push_back(capsule);
  }
  for (Finger& finger : body.fingers) {
    for (int& dof : finger.dofs) dof += dofs;
    for (int& link : finger.links) link += shift;
  }
  body.open_rad = joined(arm.rest_rad, hand.open_rad);
  body.closing_rad = joined(Eigen::VectorXd::Zero(dofs), hand.closing_rad);
  body.closing_speed = joined(Eigen::VectorXd::Ones(dofs), hand.closing_speed);
  return armed;
}

}  // namespace geocage::hands
