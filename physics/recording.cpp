#include "physics/recording.h"

#include <cmath>

#include <nlohmann/json.hpp>

#include "hands/grasp.h"
#include "pipeline/error.h"

namespace geocage::physics {

using nlohmann::json;

void Recording::see(double time_s, const char* phase, const geometry::Pose& X_WO, const geometry::Pose& X_WH,
                    const Eigen::VectorXd& q, bool last) {
  constexpr double rounding = 1e-9;  // of a sum of steps
  if (!frames.empty() && frames.back().time_s >= time_s) return;
  if (!last && !frames.empty() && time_s < frames.back().time_s + every_s - rounding) return;
  if (!X_WO.matrix().allFinite() || !q.allFinite()) return;  // a trial that ends in NaN has no pose to show
  frames.push_back({time_s, phase, hands::file_pose(X_WO), hands::file_pose(X_WH), q});
}

json to_json(const Recording& recording) {
  json times = json::array(), phases = json::array(), X_WO = json::array(), X_WH = json::array(),
       q = json::array();
  for (const Frame& frame : recording.frames) {
    times.push_back(frame.time_s);
    phases.push_back(frame.phase);
    X_WO.push_back(hands::to_json(frame.X_WO));
    X_WH.push_back(hands::to_json(frame.X_WH));
    q.push_back(std::vector<double>(frame.q.begin(), frame.q.end()));
  }
  return {{"schema", "geocage-recording 1"},
          {"grasp", recording.grasp},
          {"hand", recording.hand},
          {"object", recording.object},
          {"protocol", recording.protocol},
          {"trial", recording.trial},
          {"outcome", name(recording.outcome)},
          {"joints", recording.joints},
          {"t_s", times},
          {"phase", phases},
          {"X_WO", X_WO},
          {"X_WH", X_WH},
          {"q_rad", q}};
}

Recording recording_from(const json& document) {
  Recording recording;
  recording.grasp = document.at("grasp"), recording.hand = document.at("hand");
  recording.object = document.at("object"), recording.protocol = document.at("protocol");
  recording.trial = document.at("trial"), recording.joints = document.at("joints");
  for (const Outcome outcome : outcomes)
    if (name(outcome) == document.at("outcome").get<std::string>()) recording.outcome = outcome;
  for (std::size_t i = 0; i < document.at("t_s").size(); ++i) {
    const auto row = document.at("q_rad").at(i).get<std::vector<double>>();
    recording.frames.push_back({document.at("t_s").at(i), document.at("phase").at(i),
                                hands::pose_from_json(document.at("X_WO").at(i), "recordings.json"),
                                hands::pose_from_json(document.at("X_WH").at(i), "recordings.json"),
                                Eigen::VectorXd::Map(row.data(), static_cast<Eigen::Index>(row.size()))});
  }
  return recording;
}

json to_json(const std::vector<Recording>& recordings) {
  json list = json::array();
  for (const Recording& recording : recordings) list.push_back(to_json(recording));
  return {{"schema", "geocage-recordings 1"}, {"recordings", list}};
}

std::vector<Recording> recordings_from(const json& document) {
  std::vector<Recording> recordings;
  for (const json& entry : document.at("recordings")) recordings.push_back(recording_from(entry));
  return recordings;
}

}  // namespace geocage::physics
