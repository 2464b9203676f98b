#include "hands/hand_file.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <sstream>

#include "hands/toml_table.h"
#include "pipeline/digest.h"
#include "pipeline/spelling.h"

namespace geocage::hands {

namespace fs = std::filesystem;
using pipeline::Fault;
using pipeline::UserError;

namespace {

constexpr double largest_factor = 10;  // of a scaled hand

std::string text_of(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::ostringstream text;
  if (!fs::is_regular_file(file) || !(text << in.rdbuf()))
    throw UserError(Fault::configuration, file.string(), "this file of a hand can't be read",
                    "a hand is a folder with hand.toml and the URDF that it names");
  return text.str();
}

/// What a hand is made from, and the digest of all that was read.
struct Source {
  toml::table table;
  std::string digests;
};

Source read_toml(const fs::path& file) {
  const std::string text = text_of(file);
  return {toml_of(text, file), pipeline::sha256_of(text)};
}

/// The variant's keys over those of its base.
Source read_with_base(const fs::path& folder, const fs::path& siblings) {
  Source own = read_toml(folder / "hand.toml");
  if (!own.table.contains("base")) return own;
  TomlTable table(own.table);
  const std::string name = table.get<std::string>("base");
  const fs::path base_folder = siblings / name;
  if (name.empty() || !fs::exists(base_folder / "hand.toml"))
    table.wrong("base", "names '" + name + "', but there is no such hand in " + siblings.string());
  Source base = read_toml(base_folder / "hand.toml");
  if (base.table.contains("base")) table.wrong("base", "names a hand that is itself a variant");
  for (auto&& [key, value] : own.table)
    value.visit([&, &key = key](auto& node) { base.table.insert_or_assign(key, std::move(node)); });
  base.digests += own.digests;
  return base;
}

bool moves(const Hand& hand, int link, const std::vector<int>& dofs) {
  for (; link != 0; link = hand.tree.joints[link - 1].parent_link) {
    const Joint& joint = hand.tree.joints[link - 1];
    if (joint.type != Joint::Type::fixed && std::count(dofs.begin(), dofs.end(), joint.dof) > 0) return true;
  }
  return false;
}

std::vector<int> links_of(TomlTable& row, const Hand& hand, const std::vector<int>& dofs) {
  std::vector<int> links;
  if (row.has("links")) {
    for (const auto& name : row.list<std::string>("links"))
      links.push_back(row.index("links", name, [&](const std::string& n) { return hand.tree.link(n); }));
    if (links.empty()) row.wrong("links", "is empty");
    for (int link : links)
      if (!moves(hand, link, dofs))
        row.wrong("links", "has '" + hand.tree.links[link] + "', which no joint of the finger moves");
    return links;
  }
  for (int link = 1; link < static_cast<int>(hand.tree.links.size()); ++link)
    if (moves(hand, link, dofs)) links.push_back(link);
  return links;
}

void set_posture(TomlTable& row, const std::string& key, int dof, double value, Hand& hand) {
  if (value < hand.tree.lower_rad[dof] || value > hand.tree.upper_rad[dof])
    row.wrong(key, "is beyond the limits of joint '" + hand.tree.dof_names[dof] + "'");
  hand.open_rad[dof] = value;
}

void read_finger(TomlTable& row, Hand& hand) {
  Finger finger;
  finger.name = row.get<std::string>("name");
  for (const auto& name : row.list<std::string>("joints"))
    finger.dofs.push_back(row.index("joints", name, [&](const std::string& n) { return hand.tree.dof(n); }));
  if (finger.dofs.empty()) row.wrong("joints", "is empty");
  finger.links = links_of(row, hand, finger.dofs);
  const auto open_rad = row.list<double>("open_rad"), closing = row.list<double>("closing");
  for (auto [key, size] : {std::pair{"open_rad", open_rad.size()}, {"closing", closing.size()}})
    if (size != finger.dofs.size()) row.wrong(key, "has not one entry for each joint");
  for (std::size_t i = 0; i < finger.dofs.size(); ++i) {
    const int d = finger.dofs[i];
    if (!(std::abs(closing[i]) > 0 && std::abs(closing[i]) <= largest_factor))
      row.wrong("closing", "has an entry outside [-10, 10], or zero");
    set_posture(row, "open_rad", d, open_rad[i], hand);
    hand.closing_rad[d] = closing[i] > 0 ? 1 : -1;
    hand.closing_speed[d] = std::abs(closing[i]);
  }
  row.end();
  hand.fingers.push_back(std::move(finger));
}

void read_fingers(TomlTable& table, Hand& hand) {
  const int n = hand.tree.dofs();
  hand.open_rad = Eigen::VectorXd::Zero(n).cwiseMax(hand.tree.lower_rad).cwiseMin(hand.tree.upper_rad);
  hand.closing_rad.setZero(n);
  hand.closing_speed.setOnes(n);
  for (TomlTable row : table.tables("finger")) read_finger(row, hand);
  if (!table.has("preshape_rad")) return;
  TomlTable preshape = table.table("preshape_rad");
  for (const auto& name : preshape.keys()) {
    const int d = preshape.index(name, name, [&](const std::string& n_) { return hand.tree.dof(n_); });
    if (hand.closing_rad[d] != 0)
      preshape.wrong(name, "belongs to a finger: its place is the finger's open_rad");
    set_posture(preshape, name, d, preshape.get<double>(name), hand);
  }
}

void read_capsules(TomlTable& table, Hand& hand) {
  for (TomlTable row : table.tables("capsule")) {
    Capsule capsule;
    capsule.link = row.index("link", row.get<std::string>("link"),
                             [&](const std::string& name) { return hand.tree.link(name); });
    capsule.a_L = row.vector("a_m");
    capsule.b_L = row.vector("b_m");
    capsule.radius_m = row.length("radius_m");
    row.end();
    hand.capsules.push_back(capsule);
  }
}

void read_radii(TomlTable& table, Hand& hand) {
  hand.finger_length_m = table.length("finger_length_m");
  hand.ball_radius_m = table.length("ball_radius_m");
  for (double share : table.list<double>("ball_radii_of_finger_length")) {
    if (share <= 0) table.wrong("ball_radii_of_finger_length", "has an entry that is not positive");
    hand.ball_radii_m.push_back(share * hand.finger_length_m);
  }
}

void read_net(TomlTable& table, Hand& hand) {
  hand.tree.links = {"net"};
  hand.open_rad.resize(0);
  hand.closing_rad.resize(0);
  hand.closing_speed.resize(0);
  hand.net = NetDescription{table.length("point_radius_m"), table.length("offset_m"),
                            table.positive("stretch_share", 1)};
}

ClosingOrder closing_order(TomlTable& table) {
  if (!table.has("closing_order")) return ClosingOrder::proximal_first;
  const auto word = table.get<std::string>("closing_order");
  if (word == "proximal_first") return ClosingOrder::proximal_first;
  if (word == "together") return ClosingOrder::together;
  if (word != "breakaway")
    table.wrong("closing_order", "is none of \"proximal_first\", \"together\", \"breakaway\"");
  return ClosingOrder::breakaway;
}

void read_articulated(TomlTable& table, Hand& hand) {
  hand.palm_H = table.vector("palm_m");
  hand.approach_H = table.direction("approach");
  hand.flexion_axis_H = table.direction("flexion_axis");
  if (std::abs(hand.approach_H.dot(hand.flexion_axis_H)) > 1e-6)
    table.wrong("flexion_axis", "is not perpendicular to the approach");
  hand.spread_dof = table.get<std::string>("spread_joint");
  if (!hand.spread_dof.empty())
    table.index("spread_joint", hand.spread_dof,
                [&](const std::string& name) { return hand.tree.dof(name); });
  hand.closing_order = closing_order(table);
  if (table.has("torsion_m")) hand.torsion_m = table.length("torsion_m");
  read_fingers(table, hand);
  read_capsules(table, hand);
}

void thin_fingers(double factor, Hand& hand) {
  for (Capsule& capsule : hand.capsules)
    for (const Finger& finger : hand.fingers)
      if (std::count(finger.links.begin(), finger.links.end(), capsule.link) > 0) {
        capsule.radius_m *= factor;
        break;
      }
}

/// All lengths, those of sliding joints too.
void scale_hand(double factor, Hand& hand) {
  KinematicTree& tree = hand.tree;
  const auto slides = [](const Joint& joint) { return joint.type == Joint::Type::prismatic; };
  std::vector<double> factor_of(tree.dofs(), 1);
  for (const Joint& joint : tree.joints)
    if (slides(joint) && joint.name == tree.dof_names[joint.dof]) factor_of[joint.dof] = factor;
  for (int dof = 0; dof < tree.dofs(); ++dof)
    for (auto* values : {&tree.lower_rad, &tree.upper_rad, &tree.velocity_limit_rad_s, &hand.open_rad})
      (*values)[dof] *= factor_of[dof];
  for (Joint& joint : tree.joints) {
    joint.X_PJ.translation() *= factor;
    if (joint.type == Joint::Type::fixed) continue;
    const double own = slides(joint) ? factor : 1;
    joint.multiplier *= own / factor_of[joint.dof];
    for (double* value : {&joint.offset_rad, &joint.lower_rad, &joint.upper_rad, &joint.velocity_limit_rad_s})
      *value *= own;
  }
  for (Capsule& capsule : hand.capsules) {
    capsule.a_L *= factor;
    capsule.b_L *= factor;
    capsule.radius_m *= factor;
  }
  for (LinkMesh& mesh : tree.meshes) {
    mesh.X_LM.translation() *= factor;
    mesh.scale *= factor;
  }
  hand.palm_H *= factor;
  hand.finger_length_m *= factor;
  hand.ball_radius_m *= factor;
  hand.torsion_m *= factor;
  for (double& radius_m : hand.ball_radii_m) radius_m *= factor;
}

}  // namespace

Hand read_hand_folder(const fs::path& folder, const fs::path& siblings) {
  Source source = read_with_base(folder, siblings);
  TomlTable table(source.table);
  Hand hand;
  hand.name = pipeline::plain_name(folder.filename().string());
  if (table.has("base")) table.get<std::string>("base");  // its keys are here already
  read_radii(table, hand);
  const std::string kind = table.has("kind") ? table.get<std::string>("kind") : "articulated";
  if (kind == "net") {
    read_net(table, hand);
  } else if (kind == "articulated") {
    const fs::path urdf = fs::path(table.file_of("urdf")).parent_path() / table.get<std::string>("urdf");
    const std::string text = text_of(urdf);
    source.digests += pipeline::sha256_of(text);
    hand.tree = read_urdf(urdf);
    read_articulated(table, hand);
    if (table.has("finger_radius_scale"))
      thin_fingers(table.positive("finger_radius_scale", largest_factor), hand);
    if (table.has("scale")) scale_hand(table.positive("scale", largest_factor), hand);
  } else {
    table.wrong("kind", "is neither \"articulated\" nor \"net\"");
  }
  table.end();
  hand.sha256 = pipeline::sha256_of(hand.name + "\n" + source.digests);
  return hand;
}

}  // namespace geocage::hands
