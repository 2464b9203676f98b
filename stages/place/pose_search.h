#pragma once
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "hands/closing.h"
#include "stages/place/gripper.h"
#include "stages/place/pose_list.h"
#include "topology/polyline.h"

namespace geocage::stages {

/// What the poses of one candidate came to: grasps that pass the rules, best first, and the others by rule.
struct CandidatePoses {
  int tried = 0;
  std::vector<hands::Grasp> grasps;
  std::map<std::string, int> rejected;
};

/// All that the poses of one object and one hand share. Constant while it searches: threads may share it.
class PoseSearch {
 public:
  PoseSearch(const PlaceParams& params, const topology::Scores& scores,
             const geometry::SignedDistanceField& field, const std::optional<geometry::Plane>& support,
             const geometry::SignedDistanceField& others, const hands::Hand& hand);

  /// Tries every pose of a candidate.
  CandidatePoses search(const topology::Candidate& candidate) const;

  /// Adds to the scores of a grasp what only those that are kept need: wrap, enclosure, linking, force
  /// closure.
  void measure(hands::Grasp& grasp, const topology::Candidate& candidate) const;

 private:
  struct Closing {
    Eigen::VectorXd open;
    hands::ClosedHand hand;
    double lift_m = 0;
  };

  double com_offset_m(const PoseChoice& choice) const;
  geometry::Pose palm_at(const geometry::Vec3& p_O, const PoseChoice& choice) const;
  std::optional<geometry::Pose> first_contact(const PoseChoice& choice) const;
  const std::vector<double>& gaps_m() const { return gripper_ ? params_.straddle_m : params_.gaps_m; }
  std::optional<Eigen::VectorXd> free_preshape(const geometry::Pose& X_OH, const PoseChoice& choice) const;
  std::optional<Eigen::VectorXd> straddle(geometry::Pose& X_OH) const;
  bool is_free(const geometry::Pose& X_OH, const Eigen::VectorXd& q) const;
  double lowest_m(const std::vector<Eigen::VectorXd>& postures, const geometry::Pose& X_OH) const;
  bool meets_obstacle(const std::vector<hands::PlacedCapsule>& placed) const;
  std::string close_above_support(geometry::Pose& X_OH, const PoseChoice& choice, Closing& closing) const;
  std::string try_choice(const PoseChoice& choice, const std::optional<geometry::Pose>& contact,
                         hands::Grasp& grasp) const;
  /// The rule that turns the pose down, or empty and the grasp in `grasp`.
  std::string try_pose(geometry::Pose X_OH, const PoseChoice& choice, hands::Grasp& grasp) const;
  void rate(const hands::ClosedHand& closed, double blocked, hands::Grasp& grasp) const;
  double flux(const geometry::Pose& X_OH, const Eigen::VectorXd& q) const;
  std::vector<hands::PlacedCapsule> capsules(const geometry::Pose& X_OH, const Eigen::VectorXd& q) const;

  const PlaceParams& params_;
  const topology::Scores& scores_;
  const geometry::SignedDistanceField& field_;
  const std::optional<geometry::Plane>& support_;
  const geometry::SignedDistanceField& others_;
  const hands::Hand& hand_;
  hands::ClosingRule rule_;
  std::optional<Gripper> gripper_;
  geometry::Vec3 center_of_mass_O_;
  double torque_length_m_ = 0;                 ///< largest distance of the surface from the centre of mass
  std::vector<topology::Polyline> handles_O_;  ///< loops around the object's handles and through their holes
  std::vector<int> base_;                      ///< capsules that no finger's joint moves: palm and knuckles
  double far_m_ = 0;  ///< the base is free of the object when the palm is that far from a surface point
};

}  // namespace geocage::stages
