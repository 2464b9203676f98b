#pragma once
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "hands/closing.h"
#include "stages/place/place.h"

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
  PoseSearch(const PlaceParams& params, const geometry::SignedDistanceField& field,
             const std::optional<geometry::Plane>& support, const geometry::Vec3& center_of_mass_O,
             const hands::Hand& hand);

  /// Tries every pose of a candidate.
  CandidatePoses search(const topology::Candidate& candidate, double ball_radius_m) const;

 private:
  struct Way {
    geometry::Vec3 approach_O;
    double com_offset_m;  ///< of the centre of mass from the line through the candidate along the approach
  };

  struct Closing {
    Eigen::VectorXd open;
    hands::ClosedHand hand;
    double lift_m = 0;
  };

  std::optional<Way> way(const topology::Candidate& candidate, const std::string& approach) const;
  std::optional<geometry::Pose> first_contact(const topology::Candidate& candidate,
                                              const geometry::Vec3& approach_O, double roll_rad) const;
  std::optional<Eigen::VectorXd> free_preshape(const geometry::Pose& X_OH, double spread_rad) const;
  double lowest_m(const geometry::Pose& X_OH, const Eigen::VectorXd& open,
                  const Eigen::VectorXd& closed) const;
  std::string close_above_support(geometry::Pose& X_OH, double spread_rad, Closing& closing) const;
  /// The rule that turns the pose down, or empty and the grasp in `grasp`.
  std::string try_pose(geometry::Pose X_OH, double spread_rad, hands::Grasp& grasp) const;
  std::vector<hands::PlacedCapsule> capsules(const geometry::Pose& X_OH, const Eigen::VectorXd& q) const;

  const PlaceParams& params_;
  const geometry::SignedDistanceField& field_;
  const std::optional<geometry::Plane>& support_;
  geometry::Vec3 center_of_mass_O_;
  const hands::Hand& hand_;
  std::vector<int> base_;  ///< capsules that no finger's joint moves: palm and knuckles
  double far_m_ = 0;       ///< the base is free of the object when the palm is that far from a surface point
};

}  // namespace geocage::stages
