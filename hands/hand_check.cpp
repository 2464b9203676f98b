#include "hands/hand_check.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "hands/closing.h"
#include "hands/urdf_mesh.h"

namespace geocage::hands {

namespace {

constexpr double overlap_m = 0.001;  // of two links in the open posture
constexpr double sticks_out_m = 0.005;
constexpr int closing_samples = 20;

std::vector<PlacedCapsule> capsules_at(const Hand& hand, const Eigen::VectorXd& q) {
  return placed_capsules(hand, Pose::Identity(), q);
}

bool has_capsule(const Hand& hand, int link) {
  return std::any_of(hand.capsules.begin(), hand.capsules.end(),
                     [&](const Capsule& capsule) { return capsule.link == link; });
}

void check_fingers(const Hand& hand, HandCheck& check) {
  for (const Finger& finger : hand.fingers) {
    if (std::none_of(finger.links.begin(), finger.links.end(),
                     [&](int link) { return has_capsule(hand, link); }))
      check.problems.push_back("finger '" + finger.name + "' has no capsule: it can touch nothing");
    for (int dof : finger.dofs) {
      const std::string joint = "joint '" + hand.tree.dof_names[dof] + "'";
      if (!(hand.tree.effort_limit_nm[dof] > 0))
        check.problems.push_back(joint + " has no effort limit in the URDF");
      if (!(hand.tree.velocity_limit_rad_s[dof] > 0))
        check.problems.push_back(joint + " has no velocity limit in the URDF");
      if (!std::isfinite(hand.tree.upper_rad[dof] - hand.tree.lower_rad[dof]))
        check.problems.push_back(joint + " closes without end: give it limits");
    }
  }
}

/// How far a finger is from the line that leads from the palm along the approach: its nearest point.
double distance_to_grasp_line_m(const Hand& hand, const Finger& finger, const Eigen::VectorXd& q) {
  const PlacedCapsule line{hand.palm_H, hand.palm_H + 2 * hand.finger_length_m * hand.approach_H, 0};
  const auto placed = capsules_at(hand, q);
  double nearest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < placed.size(); ++i)
    if (std::count(finger.links.begin(), finger.links.end(), hand.capsules[i].link) > 0)
      nearest = std::min(nearest, capsule_gap_m(placed[i], line));
  return nearest;
}

void check_directions(const Hand& hand, HandCheck& check) {
  for (const Finger& finger : hand.fingers) {
    if (!std::isfinite(distance_to_grasp_line_m(hand, finger, hand.open_rad))) continue;
    double nearest_closing = std::numeric_limits<double>::infinity(), nearest_opening = nearest_closing;
    for (int k = 0; k <= closing_samples; ++k) {
      Eigen::VectorXd closing = hand.open_rad, opening = hand.open_rad;
      for (int dof : finger.dofs) {
        const bool up = hand.closing_rad[dof] > 0;
        const double share = static_cast<double>(k) / closing_samples, from = hand.open_rad[dof];
        const double end = up ? hand.tree.upper_rad[dof] : hand.tree.lower_rad[dof];
        const double start = up ? hand.tree.lower_rad[dof] : hand.tree.upper_rad[dof];
        closing[dof] = from + share * (end - from);
        opening[dof] = from + share * (start - from);
      }
      nearest_closing = std::min(nearest_closing, distance_to_grasp_line_m(hand, finger, closing));
      nearest_opening = std::min(nearest_opening, distance_to_grasp_line_m(hand, finger, opening));
    }
    if (nearest_closing > nearest_opening)
      check.problems.push_back(
          fmt::format("finger '{}' comes no nearer than {:.0f} mm to the line in front of the palm when it "
                      "closes, but {:.0f} mm when it "
                      "opens: are the signs of `closing`, and `palm_m` and `approach`, right?",
                      finger.name, 1000 * nearest_closing, 1000 * nearest_opening));
  }
}

void check_overlaps(const Hand& hand, HandCheck& check) {
  const auto placed = capsules_at(hand, hand.open_rad);
  const auto joined = [&](int a, int b) {
    return a == b || (a != 0 && hand.tree.joints[a - 1].parent_link == b) ||
           (b != 0 && hand.tree.joints[b - 1].parent_link == a);
  };
  for (std::size_t i = 0; i < placed.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) {
      const int a = hand.capsules[j].link, b = hand.capsules[i].link;
      const double gap = capsule_gap_m(placed[j], placed[i]);
      if (!joined(a, b) && gap < -overlap_m)
        check.notes.push_back(fmt::format("links '{}' and '{}' overlap by {:.1f} mm in the open posture",
                                          hand.tree.links[a], hand.tree.links[b], -1000 * gap));
    }
  std::sort(check.notes.begin(), check.notes.end());
}

void check_meshes(const Hand& hand, HandCheck& check) {
  for (const LinkMesh& mesh : hand.tree.meshes) {
    if (!has_capsule(hand, mesh.link)) continue;
    double farthest = 0;
    for (const Vec3& p : read_link_mesh(mesh).vertices) {
      double nearest = std::numeric_limits<double>::infinity();
      for (const Capsule& capsule : hand.capsules)
        if (capsule.link == mesh.link)
          nearest = std::min(nearest, capsule_gap_m({capsule.a_L, capsule.b_L, capsule.radius_m}, {p, p, 0}));
      farthest = std::max(farthest, nearest);
    }
    if (farthest > sticks_out_m)
      check.notes.push_back(fmt::format("link '{}': mesh '{}' sticks out of the capsules by {:.1f} mm",
                                        hand.tree.links[mesh.link], mesh.uri, 1000 * farthest));
  }
}

std::string vector_text(const Vec3& v) {
  return fmt::format("[{:.4f}, {:.4f}, {:.4f}]", v.x(), v.y(), v.z());
}

std::vector<std::vector<int>> children_of(const KinematicTree& tree) {
  std::vector<std::vector<int>> children(tree.links.size());
  for (const Joint& joint : tree.joints) children[joint.parent_link].push_back(joint.child_link);
  return children;
}

std::string finger_draft(const KinematicTree& tree, const std::vector<std::vector<int>>& children, int leaf) {
  std::string joints, open, closing;
  for (int link = leaf; link != 0; link = tree.joints[link - 1].parent_link) {
    const Joint& joint = tree.joints[link - 1];
    const bool own = joint.type != Joint::Type::fixed && tree.dof_names[joint.dof] == joint.name;
    if (link != leaf && children[link].size() > 1) break;  // the palm, or a wrist
    if (!own) continue;
    const std::string comma = joints.empty() ? "" : ", ";
    const double rest = std::clamp(0.0, tree.lower_rad[joint.dof], tree.upper_rad[joint.dof]);
    joints = fmt::format("\"{}\"{}{}", joint.name, comma, joints);
    open = fmt::format("{}{}{}", rest, comma, open);
    closing = fmt::format("1{}{}", comma, closing);
  }
  if (joints.empty()) return {};
  return fmt::format(
      "\n[[finger]]\nname = \"{}\"\njoints = [{}]\nopen_rad = [{}] # ?\nclosing = [{}] # ? 1 or -1, the way "
      "each turns\n",
      tree.links[leaf], joints, open, closing);
}

}  // namespace

HandCheck check_hand(const Hand& hand) {
  HandCheck check;
  if (hand.net) return check;
  check_fingers(hand, check);
  check_directions(hand, check);
  check_overlaps(hand, check);
  check_meshes(hand, check);
  return check;
}

std::string draft_hand_toml(const KinematicTree& tree, const std::string& urdf_name) {
  constexpr double radius_m = 0.01, tip_m = 0.02;
  const auto children = children_of(tree);
  std::string text = fmt::format(
      "urdf = \"{}\"\npalm_m = [0.0, 0.0, 0.0] # ? centre of the palm's surface\napproach = [0.0, 0.0, 1.0] "
      "# ? "
      "from the palm "
      "towards the object\nflexion_axis = [0.0, 1.0, 0.0] # ? axis the fingers bend about\nspread_joint = "
      "\"\" # "
      "? joint that spreads the fingers\nfinger_length_m = 0.1 # ?\nball_radius_m = 0.05 # ?\n"
      "ball_radii_of_finger_length = [0.3, 0.5, 0.75, 1.0]\n",
      urdf_name);
  for (int link = 1; link < static_cast<int>(tree.links.size()); ++link)
    if (children[link].empty()) text += finger_draft(tree, children, link);
  for (int link = 0; link < static_cast<int>(tree.links.size()); ++link) {
    std::vector<Vec3> ends;
    for (int child : children[link]) ends.push_back(tree.joints[child - 1].X_PJ.translation());
    if (ends.empty()) ends.emplace_back(0, 0, tip_m);
    for (const Vec3& end : ends)
      text +=
          fmt::format("\n[[capsule]]\nlink = \"{}\"\na_m = [0.0, 0.0, 0.0]\nb_m = {}\nradius_m = {} # ?\n",
                      tree.links[link], vector_text(end), radius_m);
  }
  return text;
}

}  // namespace geocage::hands
