#include "motion/trajectory.h"

#include <cerrno>
#include <cstdio>
#include <fstream>
#include <system_error>

#include <nlohmann/json.hpp>

#include "hands/grasp.h"

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
          {"planner", t.planner}};
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
  return t;
}

}  // namespace

std::string_view artefact_kind(const TrajectorySet*) {
  return "trajectories";
}

void save_artefact(const TrajectorySet& set, const fs::path& dir) {
  for (std::size_t i = 0; i < set.trajectories.size(); ++i) {
    std::ofstream out(file_of(dir, i));
    out << to_json(set.trajectories[i]).dump(1) << "\n";
    if (!out.flush()) throw std::system_error(errno, std::generic_category(), file_of(dir, i).string());
  }
  std::ofstream out(dir / "trajectories.json");
  out << json{{"schema", "geocage-trajectories 1"}, {"count", set.trajectories.size()}}.dump(1) << "\n";
  if (!out.flush())
    throw std::system_error(errno, std::generic_category(), (dir / "trajectories.json").string());
}

void load_artefact(TrajectorySet& set, const fs::path& dir) {
  set = {};
  const std::size_t count = json::parse(std::ifstream(dir / "trajectories.json")).at("count");
  for (std::size_t i = 0; i < count; ++i)
    set.trajectories.push_back(
        from_json(json::parse(std::ifstream(file_of(dir, i))), file_of(dir, i).string()));
}

}  // namespace geocage::motion
