#pragma once
#include <filesystem>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "hands/hand.h"

namespace geocage::hands {

/// A closed hand at an object; the file format "geocage-grasp 1" (docs/architecture.md, section 4).
struct Grasp {
  std::string hand, object;
  Pose X_OH = Pose::Identity();
  std::map<std::string, double> joints_rad, pregrasp_joints_rad;  ///< independent joints by name
  std::map<std::string, double> scores;                           ///< NaN is allowed and is null in the file
};

/// Best first. `rejected` counts the poses that a rule turned down, by the rule's name.
struct GraspSet {
  std::vector<Grasp> grasps;
  std::map<std::string, int> rejected;
};

/// q in the order of `tree.dof_names`. UserError (input) for a joint that is missing, unknown, NaN or beyond its limits
/// by more than 1e-6.
Eigen::VectorXd joint_vector(const KinematicTree& tree, const std::map<std::string, double>& joints_rad,
                             const std::string& where);
std::map<std::string, double> joint_map(const KinematicTree& tree, const Eigen::VectorXd& q);

nlohmann::json to_json(const Grasp& grasp);
/// UserError (input) naming the file and the key.
Grasp grasp_from_json(const nlohmann::json& json, const std::string& where);
/// A file of one grasp or of a list ("geocage-grasps 1").
GraspSet read_grasps(const std::filesystem::path& file);

std::string_view artefact_kind(const GraspSet*);  ///< "grasps": grasps.json, rejected.json
void save_artefact(const GraspSet& grasps, const std::filesystem::path& dir);
void load_artefact(GraspSet& grasps, const std::filesystem::path& dir);

}  // namespace geocage::hands
