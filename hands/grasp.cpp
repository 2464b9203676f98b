#include "hands/grasp.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <system_error>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "pipeline/error.h"
#include "pipeline/nearest.h"
#include "pipeline/text_file.h"

namespace geocage::hands {

using nlohmann::json;
using pipeline::Fault;
using pipeline::UserError;

namespace {

constexpr const char *grasp_schema = "geocage-grasp 1", *set_schema = "geocage-grasps 1";

const json& member(const json& object, const std::string& key, const std::string& where) {
  if (!object.is_object()) throw UserError(Fault::input, where, "is not a JSON object");
  const auto found = object.find(key);
  if (found == object.end()) throw UserError(Fault::input, where, "the key '" + key + "' is missing");
  return *found;
}

std::string text(const json& object, const std::string& key, const std::string& where) {
  const json& value = member(object, key, where);
  if (!value.is_string()) throw UserError(Fault::input, where, "'" + key + "' is not a text");
  return value.get<std::string>();
}

/// The number at `value`; null is NaN.
double number(const json& value, const std::string& where) {
  if (value.is_null()) return std::numeric_limits<double>::quiet_NaN();
  if (!value.is_number()) throw UserError(Fault::input, where, "is not a number");
  return value.get<double>();
}

template <int n>
Eigen::Vector<double, n> vector(const json& list, const std::string& place) {
  if (!list.is_array() || list.size() != n)
    throw UserError(Fault::input, place, "is not a list of " + std::to_string(n) + " numbers");
  Eigen::Vector<double, n> v;
  for (int i = 0; i < n; ++i) v[i] = number(list[i], place);
  if (!v.allFinite()) throw UserError(Fault::input, place, "holds a number that is not finite");
  return v;
}

template <int n>
Eigen::Vector<double, n> vector(const json& object, const std::string& key, const std::string& where) {
  return vector<n>(member(object, key, where), where + ": " + key);
}

std::vector<Vec3> points(const json& object, const std::string& key, const std::string& where) {
  const json& list = member(object, key, where);
  if (!list.is_array() || list.empty())
    throw UserError(Fault::input, where, "'" + key + "' is not a list of points");
  std::vector<Vec3> all;
  for (std::size_t i = 0; i < list.size(); ++i)
    all.push_back(vector<3>(list[i], fmt::format("{}: {}[{}]", where, key, i)));
  return all;
}

std::map<std::string, double> numbers(const json& object, const std::string& key, const std::string& where) {
  std::map<std::string, double> values;
  if (!object.contains(key)) return values;
  const json& map = object[key];
  if (!map.is_object()) throw UserError(Fault::input, where, "'" + key + "' is not a JSON object of numbers");
  for (const auto& [name, value] : map.items())
    values[name] = number(value, fmt::format("{}: {}.{}", where, key, name));
  return values;
}

void check_schema(const json& object, const std::string& schema, const std::string& where) {
  const std::string found = text(object, "schema", where);
  if (found != schema)
    throw UserError(Fault::input, where, "its schema is '" + found + "'",
                    "this program reads '" + schema + "'");
}

json read_json(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  if (!std::filesystem::is_regular_file(file) || !in)
    throw UserError(Fault::input, file.string(), "this file can't be read");
  try {
    return json::parse(in);
  } catch (const json::exception& error) {
    throw UserError(Fault::input, file.string(), std::string("not JSON: ") + error.what());
  }
}

void write_json(const json& value, const std::filesystem::path& file) {
  pipeline::write_text(file, value.dump(1) + "\n");
}

std::vector<Grasp> grasps_from_json(const json& value, const std::string& where) {
  const json& list = member(value, "grasps", where);
  if (!list.is_array()) throw UserError(Fault::input, where, "'grasps' is not a list");
  std::vector<Grasp> grasps;
  for (std::size_t i = 0; i < list.size(); ++i)
    grasps.push_back(grasp_from_json(list[i], where + ": grasps[" + std::to_string(i) + "]"));
  return grasps;
}

}  // namespace

Eigen::VectorXd joint_vector(const KinematicTree& tree, const std::map<std::string, double>& joints_rad,
                             const std::string& where) {
  constexpr double slack_rad = 1e-6;
  for (const auto& [name, value] : joints_rad)
    if (std::find(tree.dof_names.begin(), tree.dof_names.end(), name) == tree.dof_names.end())
      throw UserError(Fault::input, where, "the hand has no independent joint '" + name + "'",
                      "the nearest name is '" + pipeline::nearest_name(name, tree.dof_names) + "'");
  Eigen::VectorXd q(tree.dofs());
  for (int i = 0; i < tree.dofs(); ++i) {
    const auto found = joints_rad.find(tree.dof_names[i]);
    const std::string joint = "joint '" + tree.dof_names[i] + "'";
    if (found == joints_rad.end()) throw UserError(Fault::input, where, joint + " is missing");
    const double low = tree.lower_rad[i], high = tree.upper_rad[i];
    if (!(found->second >= low - slack_rad && found->second <= high + slack_rad))
      throw UserError(Fault::input, where, joint + " is " + std::to_string(found->second) + " rad",
                      "its limits are [" + std::to_string(low) + ", " + std::to_string(high) + "]");
    q[i] = std::clamp(found->second, low, high);
  }
  return q;
}

std::map<std::string, double> joint_map(const KinematicTree& tree, const Eigen::VectorXd& q) {
  std::map<std::string, double> joints_rad;
  for (int i = 0; i < tree.dofs(); ++i) joints_rad[tree.dof_names[i]] = q[i];
  return joints_rad;
}

json to_json(const Pose& pose) {
  // Twelve decimals: then rounding absorbs the noise of going from matrix to quaternion and back (file_pose).
  const auto rounded = [](double x) { return std::round(x * 1e12) / 1e12; };
  const Vec3 p = pose.translation();
  const Eigen::Quaterniond q(pose.linear());
  return {{"p_m", {p.x(), p.y(), p.z()}},
          {"q_wxyz", {rounded(q.w()), rounded(q.x()), rounded(q.y()), rounded(q.z())}}};
}

Pose pose_from_json(const json& object, const std::string& where) {
  const Vec3 p = vector<3>(object, "p_m", where);
  const Eigen::Vector4d wxyz = vector<4>(object, "q_wxyz", where);
  const Eigen::Quaterniond q(wxyz[0], wxyz[1], wxyz[2], wxyz[3]);
  if (std::abs(q.norm() - 1) > 1e-3)
    throw UserError(Fault::input, where + ": q_wxyz",
                    "is not a unit quaternion: its length is " + std::to_string(q.norm()));
  Pose pose = Pose::Identity();
  pose.translation() = p;
  pose.linear() = q.normalized().toRotationMatrix();
  return pose;
}

Pose file_pose(const Pose& pose) {
  Pose before = pose, after = pose_from_json(to_json(pose), "a pose");
  for (int round = 0; round < 20 && after.matrix() != before.matrix(); ++round) {
    before = after;
    after = pose_from_json(to_json(before), "a pose");
  }
  return after;
}

json to_json(const Grasp& grasp) {
  json scores = json::object();
  for (const auto& [name, value] : grasp.scores) scores[name] = std::isnan(value) ? json() : json(value);
  json object = {{"schema", grasp_schema},
                 {"hand", grasp.hand},
                 {"object", grasp.object},
                 {"X_OH", to_json(grasp.X_OH)},
                 {"scores", scores}};
  if (grasp.points_O.empty()) {
    object["joints_rad"] = grasp.joints_rad;
    object["pregrasp_joints_rad"] = grasp.pregrasp_joints_rad;
  }
  for (const Vec3& p : grasp.points_O) object["points_m"].push_back({p.x(), p.y(), p.z()});
  if (!grasp.force_closure.empty()) object["force_closure"] = grasp.force_closure;
  if (!grasp.heuristic.empty()) object["heuristic"] = grasp.heuristic;
  return object;
}

Grasp grasp_from_json(const json& object, const std::string& where) {
  check_schema(object, grasp_schema, where);
  Grasp grasp;
  grasp.hand = text(object, "hand", where);
  grasp.object = text(object, "object", where);
  if (object.contains("heuristic")) grasp.heuristic = text(object, "heuristic", where);
  grasp.X_OH = pose_from_json(member(object, "X_OH", where), where + ": X_OH");
  if (object.contains("force_closure")) grasp.force_closure = text(object, "force_closure", where);
  if (object.contains("points_m"))
    grasp.points_O = points(object, "points_m", where);
  else
    member(object, "joints_rad", where);
  grasp.joints_rad = numbers(object, "joints_rad", where);
  grasp.pregrasp_joints_rad = numbers(object, "pregrasp_joints_rad", where);
  grasp.scores = numbers(object, "scores", where);
  return grasp;
}

GraspSet read_grasps(const std::filesystem::path& file) {
  const json value = read_json(file);
  const std::string where = file.string(), schema = text(value, "schema", where);
  if (schema == grasp_schema) return {{grasp_from_json(value, where)}, {}};
  if (schema == set_schema) return {grasps_from_json(value, where), {}};
  throw UserError(Fault::input, where, "its schema is '" + schema + "'",
                  fmt::format("this program reads '{}' and '{}'", grasp_schema, set_schema));
}

std::string_view artefact_kind(const GraspSet*) {
  return "grasps";
}

void save_artefact(const GraspSet& set, const std::filesystem::path& dir) {
  json list = json::array();
  for (const Grasp& grasp : set.grasps) list.push_back(to_json(grasp));
  write_json({{"schema", set_schema}, {"grasps", list}}, dir / "grasps.json");
  write_json(set.rejected, dir / "rejected.json");
}

void load_artefact(GraspSet& set, const std::filesystem::path& dir) {
  set = read_grasps(dir / "grasps.json");
  set.rejected = read_json(dir / "rejected.json").get<std::map<std::string, int>>();
}

}  // namespace geocage::hands
