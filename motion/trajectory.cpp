#include "motion/trajectory.h"

#include <cerrno>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <system_error>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "hands/grasp.h"
#include "pipeline/text_file.h"

namespace geocage::motion {

namespace fs = std::filesystem;
using nlohmann::json;

namespace {

fs::path file_of(const fs::path& dir, std::size_t i) {
  return dir / ("trajectory_" + std::to_string(i) + ".json");
}

json to_json(const Trajectory& t) {
  json poses = json::array();
  for (const auto& X_OH : t.X_OH) poses.push_back(hands::to_json(X_OH));
  return {{"schema", "geocage-trajectory 1"},
          {"dt_s", t.dt_s},
          {"joints", t.joints},
          {"q_rad", t.q_rad},
          {"X_OH", poses},
          {"min_clearance_m", t.min_clearance_m},
          {"certified", t.certified},
          {"outcome", t.outcome},
          {"planner", t.planner},
          {"seed", t.seed},
          {"free_steps", t.free_steps},
          {"self_clearance_m", t.self_clearance_m},
          {"likely_duration_s", t.likely_duration_s},
          {"efficiency",
           {{"cost", t.efficiency.cost},
            {"effort", t.efficiency.effort},
            {"duration_s", t.efficiency.duration_s},
            {"length", t.efficiency.length},
            {"smoothness", t.efficiency.smoothness}}},
          {"arm", t.arm.empty() ? json() : json{{"name", t.arm}, {"X_OB", hands::to_json(t.X_OB)}}}};
}

Trajectory from_json(const json& j, const std::string& where) {
  Trajectory t;
  t.dt_s = j.at("dt_s");
  t.joints = j.at("joints").get<std::vector<std::string>>();
  t.q_rad = j.at("q_rad").get<std::vector<std::vector<double>>>();
  for (const auto& pose : j.at("X_OH")) t.X_OH.push_back(hands::pose_from_json(pose, where));
  t.min_clearance_m = j.at("min_clearance_m");
  t.certified = j.at("certified");
  t.outcome = j.at("outcome");
  t.planner = j.at("planner");
  t.seed = j.at("seed");
  t.free_steps = j.at("free_steps");
  t.self_clearance_m = j.at("self_clearance_m");
  t.likely_duration_s = j.at("likely_duration_s");
  const json& e = j.at("efficiency");
  t.efficiency = {e.at("cost"), e.at("effort"), e.at("duration_s"), e.at("length"), e.at("smoothness")};
  if (j.at("arm").is_null()) return t;
  t.arm = j.at("arm").at("name");
  t.X_OB = hands::pose_from_json(j.at("arm").at("X_OB"), where);
  return t;
}

}  // namespace

std::string csv_of(const Trajectory& t) {
  std::string csv = "time_s,x_m,y_m,z_m,qw,qx,qy,qz";
  for (const auto& name : t.joints) csv += "," + name + "_rad";
  csv += "\n";
  for (std::size_t k = 0; k < t.q_rad.size(); ++k) {
    const auto& p = t.X_OH[k].translation();
    const Eigen::Quaterniond q(t.X_OH[k].linear());
    csv += fmt::format("{:.6f},{:.9f},{:.9f},{:.9f},{:.9f},{:.9f},{:.9f},{:.9f}",
                       static_cast<double>(k) * t.dt_s, p.x(), p.y(), p.z(), q.w(), q.x(), q.y(), q.z());
    for (double value : t.q_rad[k]) csv += fmt::format(",{:.9f}", value);
    csv += "\n";
  }
  return csv;
}

namespace {

/// seconds and nanoseconds, as ROS writes a duration.
std::string time_from_start(double s) {
  const auto nanoseconds = static_cast<long long>(std::llround(s * 1e9));
  return fmt::format("{{sec: {}, nanosec: {}}}", nanoseconds / 1000000000, nanoseconds % 1000000000);
}

}  // namespace

std::string joint_trajectory_of(const Trajectory& t) {
  const std::size_t steps = t.q_rad.size();
  std::string yaml = "joint_trajectory:\n  header: {frame_id: object}\n";
  yaml += fmt::format("  joint_names: [{}]\n  points:\n", fmt::join(t.joints, ", "));
  for (std::size_t k = 0; k < steps; ++k) {
    std::vector<double> speed(t.joints.size(), 0);
    if (k > 0 && k + 1 < steps)
      for (std::size_t i = 0; i < speed.size(); ++i)
        speed[i] = (t.q_rad[k + 1][i] - t.q_rad[k - 1][i]) / (2 * t.dt_s);
    yaml += fmt::format("    - positions: [{:.9f}]\n      velocities: [{:.9f}]\n      time_from_start: {}\n",
                        fmt::join(t.q_rad[k], ", "), fmt::join(speed, ", "),
                        time_from_start(static_cast<double>(k) * t.dt_s));
  }
  if (!t.arm.empty()) return yaml;
  yaml +=
      "multi_dof_joint_trajectory:\n  header: {frame_id: object}\n  joint_names: [hand_base]\n  points:\n";
  for (std::size_t k = 0; k < steps; ++k) {
    const auto& p = t.X_OH[k].translation();
    const Eigen::Quaterniond q(t.X_OH[k].linear());
    yaml += fmt::format(
        "    - transforms: [{{translation: {{x: {:.9f}, y: {:.9f}, z: {:.9f}}}, rotation: {{x: {:.9f}, "
        "y: {:.9f}, z: {:.9f}, w: {:.9f}}}}}]\n      time_from_start: {}\n",
        p.x(), p.y(), p.z(), q.x(), q.y(), q.z(), q.w(), time_from_start(static_cast<double>(k) * t.dt_s));
  }
  return yaml;
}

std::string_view artefact_kind(const TrajectorySet*) {
  return "trajectories";
}

void save_artefact(const TrajectorySet& set, const fs::path& dir) {
  for (std::size_t i = 0; i < set.trajectories.size(); ++i) {
    const Trajectory& t = set.trajectories[i];
    pipeline::write_text(file_of(dir, i), to_json(t).dump(1) + "\n");
    if (t.q_rad.empty()) continue;
    const std::string name = "trajectory_" + std::to_string(i);
    pipeline::write_text(dir / (name + ".csv"), csv_of(t));
    pipeline::write_text(dir / (name + "_ros.yaml"), joint_trajectory_of(t));
  }
  pipeline::write_text(
      dir / "trajectories.json",
      json{{"schema", "geocage-trajectories 1"}, {"count", set.trajectories.size()}}.dump(1) + "\n");
}

void load_artefact(TrajectorySet& set, const fs::path& dir) {
  set = {};
  const std::size_t count = json::parse(std::ifstream(dir / "trajectories.json")).at("count");
  for (std::size_t i = 0; i < count; ++i)
    set.trajectories.push_back(
        from_json(json::parse(std::ifstream(file_of(dir, i))), file_of(dir, i).string()));
}

}  // namespace geocage::motion
