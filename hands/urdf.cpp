#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <map>
#include <mutex>
#include <sstream>

#include <console_bridge/console.h>
#include <urdf_model/model.h>
#include <urdf_parser/urdf_parser.h>

#include "hands/kinematics.h"
#include "hands/urdf_mesh.h"
#include "pipeline/error.h"
#include "pipeline/nearest.h"

namespace geocage::hands {

namespace {

constexpr double farthest_offset_m = 10, largest_scale = 1e4;

/// Catches what urdfdom would print; the first error is the reason of a refusal. urdfdom's log is global to
/// the process, hence the lock.
class UrdfErrors : public console_bridge::OutputHandler {
 public:
  UrdfErrors() : lock_(mutex()) { console_bridge::useOutputHandler(this); }
  ~UrdfErrors() override { console_bridge::restorePreviousOutputHandler(); }
  void log(const std::string& text, console_bridge::LogLevel level, const char*, int) override {
    if (level >= console_bridge::CONSOLE_BRIDGE_LOG_ERROR) text_ += (text_.empty() ? "" : "; ") + text;
  }
  const std::string& text() const { return text_; }

 private:
  static std::mutex& mutex() {
    static std::mutex mutex;
    return mutex;
  }
  std::lock_guard<std::mutex> lock_;
  std::string text_;
};

/// Builds the tree depth first from urdfdom's model, refusing by name what a kinematic tree can't be.
class TreeBuilder {
 public:
  TreeBuilder(const urdf::ModelInterface& model, const std::string& where) : model_(model), where_(where) {}

  KinematicTree build() {
    add_link(*model_.getRoot());
    for (const auto& [name, link] : model_.links_)
      if (!index_.count(name))
        refuse("link '" + name + "' is in a cycle and can't be reached from the root link");
    for (Joint& joint : tree_.joints)
      if (joint.type != Joint::Type::fixed) follow_mimic(joint);
    set_limits();
    return std::move(tree_);
  }

 private:
  [[noreturn]] void refuse(const std::string& sentence, const std::string& hint = {}) const {
    throw pipeline::UserError(pipeline::Fault::configuration, where_, sentence, hint);
  }

  void finite(const std::string& what, std::initializer_list<double> numbers) const {
    for (double x : numbers)
      if (!std::isfinite(x)) refuse(what + " is not a finite number");
  }

  void add_link(const urdf::Link& link) {
    if (!index_.emplace(link.name, static_cast<int>(tree_.links.size())).second)
      refuse("link '" + link.name + "' is the child of two joints: a cycle", "a hand is a tree of links");
    tree_.links.push_back(link.name);
    add_meshes(link, link.visual_array, false);
    add_meshes(link, link.collision_array, true);
    for (const auto& child : link.child_joints) {
      tree_.joints.push_back(convert(*child, index_.at(link.name)));
      add_link(*model_.getLink(child->child_link_name));
    }
  }

  template <class Shapes>
  void add_meshes(const urdf::Link& link, const Shapes& shapes, bool collision) {
    for (const auto& shape : shapes) {
      const auto* mesh = dynamic_cast<const urdf::Mesh*>(shape->geometry.get());
      if (!mesh) continue;
      for (double s : {mesh->scale.x, mesh->scale.y, mesh->scale.z})
        if (!(std::abs(s) >= 1 / largest_scale && std::abs(s) <= largest_scale))
          refuse("link '" + link.name + "': the scale of mesh '" + mesh->filename +
                     "' is zero, absurd or not finite",
                 "use a factor in [1e-4, 1e4], for example 0.001 for millimetres");
      tree_.meshes.push_back(
          {index_.at(link.name),
           pose("link '" + link.name + "': the origin of mesh '" + mesh->filename + "'", shape->origin),
           Vec3(mesh->scale.x, mesh->scale.y, mesh->scale.z),
           mesh->filename,
           {},
           collision});
    }
  }

  Pose pose(const std::string& what, const urdf::Pose& from) const {
    const auto& p = from.position;
    const auto& r = from.rotation;
    finite(what, {p.x, p.y, p.z, r.x, r.y, r.z, r.w});
    const Vec3 place(p.x, p.y, p.z);
    if (place.norm() > farthest_offset_m)
      refuse(what + " is more than 10 m from its parent link", "lengths of a URDF are metres");
    return Eigen::Translation3d(place) * Eigen::Quaterniond(r.w, r.x, r.y, r.z).normalized();
  }

  Joint convert(const urdf::Joint& from, int parent_link) {
    const std::string name = "joint '" + from.name + "'";
    Joint to;
    to.name = from.name;
    to.parent_link = parent_link;
    to.child_link = static_cast<int>(tree_.links.size());
    to.X_PJ = pose(name + ": its origin", from.parent_to_joint_origin_transform);
    if (from.type == urdf::Joint::FIXED) return to;
    set_motion(from, name, to);
    if (from.mimic) {
      finite(name + ": its mimic", {from.mimic->multiplier, from.mimic->offset});
      if (from.mimic->multiplier == 0)
        refuse(name + ": its mimic multiplier is zero", "make the joint fixed");
    }
    return to;
  }

  void set_motion(const urdf::Joint& from, const std::string& name, Joint& to) const {
    constexpr double inf = std::numeric_limits<double>::infinity();
    const bool continuous = from.type == urdf::Joint::CONTINUOUS;
    if (!continuous && from.type != urdf::Joint::REVOLUTE && from.type != urdf::Joint::PRISMATIC)
      refuse(name + " is planar or floating", "use fixed, revolute, continuous or prismatic joints");
    to.type = from.type == urdf::Joint::PRISMATIC ? Joint::Type::prismatic : Joint::Type::revolute;
    finite(name + ": its axis", {from.axis.x, from.axis.y, from.axis.z});
    to.axis_J = Vec3(from.axis.x, from.axis.y, from.axis.z);
    if (to.axis_J.norm() < 1e-9) refuse(name + ": its axis has no direction");
    to.axis_J.normalize();
    if (!from.limits && !continuous) refuse(name + " has no limits");
    to.lower_rad = continuous ? -inf : from.limits->lower;
    to.upper_rad = continuous ? inf : from.limits->upper;
    if (!continuous) finite(name + ": its limits", {to.lower_rad, to.upper_rad});
    if (to.lower_rad > to.upper_rad) refuse(name + ": its lower limit is above its upper limit");
    if (!from.limits) return;
    finite(name + ": its limits", {from.limits->velocity, from.limits->effort});
    to.velocity_limit_rad_s = from.limits->velocity;
    to.effort_limit_nm = from.limits->effort;
  }

  /// Resolves a chain of mimics to the independent joint at its end, which gets a place in q.
  void follow_mimic(Joint& joint) {
    std::string master = joint.name;
    for (std::size_t steps = 0; const auto mimic = model_.getJoint(master)->mimic; ++steps) {
      if (mimic->joint_name == master) refuse("joint '" + master + "' mimics itself");
      if (steps > tree_.joints.size()) refuse("joint '" + joint.name + "' mimics in a circle");
      const auto next = model_.getJoint(mimic->joint_name);
      if (!next || next->type == urdf::Joint::FIXED)
        refuse("joint '" + master + "' mimics '" + mimic->joint_name + "', which is not a moving joint",
               "the nearest name is '" + pipeline::nearest_name(mimic->joint_name, joint_names()) + "'");
      joint.offset_rad += joint.multiplier * mimic->offset;
      joint.multiplier *= mimic->multiplier;
      master = mimic->joint_name;
    }
    auto& names = tree_.dof_names;
    joint.dof = static_cast<int>(std::find(names.begin(), names.end(), master) - names.begin());
    if (joint.dof == tree_.dofs()) names.push_back(master);
  }

  std::vector<std::string> joint_names() const {
    std::vector<std::string> names;
    for (const auto& joint : tree_.joints) names.push_back(joint.name);
    return names;
  }

  void set_limits() {
    constexpr double inf = std::numeric_limits<double>::infinity();
    const int n = tree_.dofs();
    tree_.lower_rad.setConstant(n, -inf);
    tree_.upper_rad.setConstant(n, inf);
    tree_.velocity_limit_rad_s.setConstant(n, inf);
    tree_.effort_limit_nm.setZero(n);
    for (const Joint& joint : tree_.joints) {
      if (joint.type == Joint::Type::fixed) continue;
      const double a = (joint.lower_rad - joint.offset_rad) / joint.multiplier;
      const double b = (joint.upper_rad - joint.offset_rad) / joint.multiplier;
      double& lower = tree_.lower_rad[joint.dof];
      double& upper = tree_.upper_rad[joint.dof];
      double& velocity = tree_.velocity_limit_rad_s[joint.dof];
      lower = std::max(lower, std::min(a, b));
      upper = std::min(upper, std::max(a, b));
      velocity = std::min(velocity, joint.velocity_limit_rad_s / std::abs(joint.multiplier));
      if (lower > upper)
        refuse("joint '" + joint.name + "': its mimic leaves its master no value within the limits");
      if (joint.name == tree_.dof_names[joint.dof]) tree_.effort_limit_nm[joint.dof] = joint.effort_limit_nm;
    }
  }

  const urdf::ModelInterface& model_;
  const std::string& where_;
  KinematicTree tree_;
  std::map<std::string, int> index_;
};

}  // namespace

KinematicTree parse_urdf(const std::string& text, const std::string& where) {
  UrdfErrors errors;
  urdf::ModelInterfaceSharedPtr model;
  std::string reason;
  try {
    model = urdf::parseURDF(text);
    reason = errors.text();  // urdfdom may leave out a broken part and go on
  } catch (const std::exception& error) {
    reason = error.what();
  }
  if (!model || !reason.empty())
    throw pipeline::UserError(
        pipeline::Fault::configuration, where, "not a valid URDF" + (reason.empty() ? "" : ": " + reason),
        "numbers are finite, each joint names a parent and a child link that exist, the links form one tree");
  return TreeBuilder(*model, where).build();
}

KinematicTree read_urdf(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::ostringstream text;
  if (!std::filesystem::is_regular_file(file) || !(text << in.rdbuf()))
    throw pipeline::UserError(pipeline::Fault::configuration, file.string(), "this URDF can't be read",
                              "does the file exist, and has it anything in it?");
  KinematicTree tree = parse_urdf(text.str(), file.string());
  for (LinkMesh& mesh : tree.meshes) mesh.file = find_mesh(mesh, tree, file);
  return tree;
}

}  // namespace geocage::hands
