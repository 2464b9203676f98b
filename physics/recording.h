#pragma once
#include <string>
#include <vector>

#include "physics/outcome.h"
#include <nlohmann/json_fwd.hpp>

#include "geometry/pose.h"
#include "hands/hand.h"

namespace geocage::physics {

/// A trial at one moment. W has the axes of O at the start.
struct Frame {
  double time_s = 0;
  std::string phase;  ///< "settle", "push", "pull", ...
  geometry::Pose X_WO = geometry::Pose::Identity(), X_WH = geometry::Pose::Identity();
  Eigen::VectorXd q;  ///< independent joints, rad or m
};

/// A trial as it went, for playback. Trials that are given one fill `frames`; it never changes their outcome.
struct Recording {
  int grasp = 0;
  std::string hand, object, protocol;
  std::string trial;  ///< "push +x", "pull -z", "ring 90 deg", "wrench 5 weights, seed 2"
  Outcome outcome = Outcome::held;
  std::vector<std::string> joints;  ///< names of q
  double every_s = 0.04;
  std::vector<Frame> frames;

  /// Keeps the frame when `every_s` has passed since the last one, or when `last` says that there are no
  /// more. Poses as their file gives them back (hands::file_pose).
  void see(double time_s, const char* phase, const geometry::Pose& X_WO, const geometry::Pose& X_WH,
           const Eigen::VectorXd& q, bool last = false);
};

/// The document "geocage-recording 1" (docs/formats.md).
nlohmann::json to_json(const Recording& recording);
Recording recording_from(const nlohmann::json& document);
/// The list "geocage-recordings 1".
nlohmann::json to_json(const std::vector<Recording>& recordings);
std::vector<Recording> recordings_from(const nlohmann::json& document);

}  // namespace geocage::physics
