#pragma once
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "hands/hand.h"

namespace geocage::hands {

/// A closed hand at an object; the file format "geocage-grasp 1" (docs/architecture.md, section 4).
struct Grasp {
  std::string hand, object;
  std::string heuristic;  ///< what chose the place: "winding", "curvature", "random", or empty
  Pose X_OH = Pose::Identity();
  std::map<std::string, double> joints_rad, pregrasp_joints_rad;  ///< independent joints by name
  std::vector<Vec3> points_O;            ///< of a net of points, which has no joints; empty for a hand
  std::map<std::string, double> scores;  ///< NaN is null in the file
  std::string force_closure;             ///< "force closure" or the reason why not; empty: not asked
};

/// Best first. `rejected` counts the poses that a rule turned down, by the rule's name.
struct GraspSet {
  std::vector<Grasp> grasps;
  std::map<std::string, int> rejected;
};

/// q in the order of `tree.dof_names`. UserError (input) for a joint that is missing, unknown, NaN or beyond
/// its limits by more than 1e-6.
Eigen::VectorXd joint_vector(const KinematicTree& tree, const std::map<std::string, double>& joints_rad,
                             const std::string& where);
std::map<std::string, double> joint_map(const KinematicTree& tree, const Eigen::VectorXd& q);

/// {"p_m": [x, y, z], "q_wxyz": [w, x, y, z]}, as files hold poses.
nlohmann::json to_json(const Pose& pose);
/// UserError (input) for numbers that are missing or not finite, and for a quaternion more than 1e-3 from
/// unit length.
Pose pose_from_json(const nlohmann::json& json, const std::string& where);
/// The nearest pose that its file gives back bit by bit; turns it by less than 1e-11 rad.
Pose file_pose(const Pose& pose);

nlohmann::json to_json(const Grasp& grasp);
/// UserError (input) naming the file and the key. Either `joints_rad` or, of a net of points, `points_m`.
Grasp grasp_from_json(const nlohmann::json& json, const std::string& where);
/// A file of one grasp or of a list ("geocage-grasps 1").
GraspSet read_grasps(const std::filesystem::path& file);

/// "grasps": grasps.json, rejected.json. Exact for poses of `file_pose`.
std::string_view artefact_kind(const GraspSet*);
void save_artefact(const GraspSet& grasps, const std::filesystem::path& dir);
void load_artefact(GraspSet& grasps, const std::filesystem::path& dir);

}  // namespace geocage::hands
