#pragma once
#include <optional>
#include <vector>

#include "motion/floating_hand.h"

namespace geocage::motion {

/// A lower bound of the true signed distance of `p_O` to the surface that the field was built from. The field
/// interpolates exact node distances with weights w_i; with E^2 = sum w_i |n_i - p|^2, Jensen's inequality
/// gives value <= sqrt(d^2 + E^2) in front of the surface and value <= d + E everywhere, so d is at least
/// sqrt(value^2 - E^2), or value - E near the surface. Outside the grid the distance to its box adds at a
/// right angle. Proven, not measured. Precondition: the surface lies inside the grid's box. O(1).
double distance_at_least_m(const geometry::SignedDistanceField& field, const Vec3& p_O);

enum class Proof {
  free,       ///< no capsule is anywhere deeper than its tolerance
  collides,   ///< a posture was found that can't be called free
  undecided,  ///< bisection ended before either was shown
};

struct Certificate {
  Proof outcome = Proof::free;
  /// Proven for the whole path when free, at most `resolution_m` below what was seen; else what was seen at
  /// worst. A lower bound of the clearance itself, field error taken off.
  double clearance_m = 0;
  double at = 0;     ///< where the least was seen: 3.5 is halfway from waypoint 3 to 4
  int link = 0;      ///< whose capsule it was
  int postures = 0;  ///< looked at
};

struct ProofRule {
  double resolution_m = 0.001;  ///< of the least clearance
  int bisections = 14;          ///< of a step of the path at most
};

/// Proves that a hand moves freely along a piecewise linear path of states, all the time between waypoints
/// included: a capsule that is d from the surface at a posture is free as long as no point of it has moved d.
/// Steps are bisected where that does not reach. `hand` and `field` must outlive it. Hand against hand is not
/// looked at.
class Prover {
 public:
  Prover(const FloatingHand& hand, const geometry::SignedDistanceField& field,
         const std::optional<geometry::Plane>& support, const ProofRule& rule = {});

  /// `tolerance_m` of every link: how deep it may be. Intended contacts have more than the others.
  /// O(steps x capsules x bisections).
  Certificate certify(const std::vector<Eigen::VectorXd>& path, const std::vector<double>& tolerance_m);
  /// Whether every capsule is proven at least `clearance_m` away at one posture.
  bool posture_free(const Eigen::VectorXd& x, double clearance_m);
  /// No point of capsule i moves further when the state changes from x by any part of `change`, from the
  /// posture that was looked at last, x. Left Jacobian of SO(3) and lever arms bound the speeds.
  double travel_m(int capsule, const Eigen::VectorXd& change) const;
  void look_at(const Eigen::VectorXd& x);
  const std::vector<hands::PlacedCapsule>& placed_O() const { return placed_; }

 private:
  double least_on_axis_m(const Vec3& a, const Vec3& b, double need_m, double& seen_m) const;
  double at_least_m(int capsule, double need_m, double& seen_m) const;
  void prove(const Eigen::VectorXd& from, const Eigen::VectorXd& step, double middle, double half,
             const std::vector<int>& open, const std::vector<double>& tolerance_m);
  void note(int capsule, double seen_m, double at);

  const FloatingHand& hand_;
  const geometry::SignedDistanceField& field_;
  const std::optional<geometry::Plane> support_;
  const ProofRule rule_;
  Eigen::MatrixXd levers_m_;  ///< capsules x dofs
  std::vector<Pose> X_HL_;
  std::vector<hands::PlacedCapsule> placed_;
  Eigen::VectorXd reach_m_;  ///< of each capsule's axis from H, at the last posture
  Certificate answer_;
  double proven_m_ = 0, seen_m_ = 0;
  int waypoint_ = 0;
};

}  // namespace geocage::motion
