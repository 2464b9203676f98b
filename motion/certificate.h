#pragma once
#include <limits>
#include <utility>
#include <vector>

#include "motion/mover.h"
#include "motion/tasks/clearance.h"

namespace geocage::motion {

/// A lower bound of the true signed distance of `p_O` to the surface that the field was built from. The field
/// interpolates exact node distances with weights w_i; with E^2 = sum w_i |n_i - p|^2, Jensen's inequality
/// gives value <= sqrt(d^2 + E^2) in front of the surface and value <= d + E everywhere, so d is at least
/// sqrt(value^2 - E^2), or value - E near the surface. Outside the grid the distance to its box adds at a
/// right angle, and the box that the surface must lie in says more where it is further. `node_excess_m`: how
/// much too large node values may be. Proven, not measured. Precondition: the surface lies inside the grid's
/// box.
class DistanceBound {
 public:
  /// O(nodes on the grid's faces).
  explicit DistanceBound(const geometry::SignedDistanceField& field, double node_excess_m = 0);
  /// O(1).
  double at_least_m(const Vec3& p_O) const;
  /// No point of the surface is outside of this: every one is as far from a face of the grid as the nearest
  /// point of that face is from the surface.
  const Vec3& low_O() const { return low_O_; }
  const Vec3& high_O() const { return high_O_; }

 private:
  const geometry::SignedDistanceField* field_;
  double excess_m_;
  Vec3 low_O_, high_O_;
};

enum class Proof {
  free,       ///< no capsule is anywhere deeper than its tolerance
  collides,   ///< a posture was found that can't be called free
  undecided,  ///< bisection ended before either was shown
};

struct Certificate {
  Proof outcome = Proof::free;
  /// Of the least clearance, `link` belongs to one side and this to the other: a link, or
  static constexpr int of_object = -1,
                       of_support = -2;  ///< the first field and the plane; fields after it from -3 on
  /// Proven for the whole path when free, at most `resolution_m` below what was seen; else what was seen at
  /// worst. A lower bound of the clearance itself, field error taken off. Of obstacles; self_clearance_m is
  /// of the body with itself, proven too when free, and at least what it takes.
  double clearance_m = 0, self_clearance_m = 0;
  double at = 0;  ///< where the least was seen: 3.5 is halfway from waypoint 3 to 4
  int link = 0;   ///< whose capsule it was
  int other = of_object;
  int postures = 0;  ///< looked at
  int steps = 0;     ///< of the path, from its beginning, that are proven free of obstacles
};

struct ProofRule {
  double resolution_m = 0.001;  ///< of the least clearance
  int bisections = 14;          ///< of a step of the path at most
};

/// Proves that a body moves freely along a piecewise linear path of states, all the time between waypoints
/// included: a capsule that is d from the surface at a posture is free as long as no point of it has moved d,
/// two capsules as long as they have not moved their gap towards each other. Steps are bisected where that
/// does not reach. `mover` and the fields must outlive it. `self_pairs` (motion::self_pairs) may be empty.
class Prover {
 public:
  Prover(const Mover& mover, const Obstacles& obstacles, std::vector<std::pair<int, int>> self_pairs = {},
         const ProofRule& rule = {});

  /// `tolerance_m` of every link: how deep it may be; a negative one is room that it has to have. Intended
  /// contacts have more than the others. Pairs of capsules may overlap by the smaller of their links'
  /// tolerances, and may always touch. O(steps x capsules x bisections).
  Certificate certify(const std::vector<Eigen::VectorXd>& path, const std::vector<double>& tolerance_m);
  /// Whether it would be free; how near it comes is not looked for, which is cheaper.
  bool frees(const std::vector<Eigen::VectorXd>& path, const std::vector<double>& tolerance_m);
  /// The same, with where it ends; its clearances are bounds only.
  Certificate check(const std::vector<Eigen::VectorXd>& path, const std::vector<double>& tolerance_m);
  /// Whether every capsule is proven at least `clearance_m` away at one posture, and every pair is apart (or
  /// not deeper than a negative `clearance_m`).
  bool posture_free(const Eigen::VectorXd& x, double clearance_m);
  /// The same with a tolerance for each link; a negative one is room that it has to have.
  bool posture_free(const Eigen::VectorXd& x, const std::vector<double>& tolerance_m);
  /// Whether some capsule, at its middle or an end, can't be told to be free: no path through x is proven.
  /// Cheaper than a proof, and no proof when it doesn't.
  bool touches(const Eigen::VectorXd& x, const std::vector<double>& tolerance_m);
  /// No point of capsule i moves further when the state changes from x by any part of `change`, from the
  /// posture that was looked at last, x. Left Jacobian of SO(3) and lever arms bound the speeds.
  double travel_m(int capsule, const Eigen::VectorXd& change) const;
  /// The same from any posture.
  double any_travel_m(int capsule, const Eigen::VectorXd& change) const;
  /// As travel_m with the levers that the posture has, which joints beyond can lengthen by what they move
  /// only: a smaller bound, and dearer.
  double near_travel_m(int capsule, const Eigen::VectorXd& change) const;
  void look_at(const Eigen::VectorXd& x);
  const std::vector<hands::PlacedCapsule>& placed_O() const { return placed_; }

 private:
  /// One lever of a capsule: a joint between it and the base.
  struct Lever {
    int link, dof;
    bool slides;
    double multiplier,
        reach_m;  ///< |multiplier|, and the furthest that the axis can be, whatever the posture
  };
  struct Seen {
    double distance_m = std::numeric_limits<double>::infinity();
    int other = Certificate::of_object;
    void take(double d, int what) {
      if (d < distance_m) *this = {d, what};
    }
  };

  double least_on_axis_m(const DistanceBound& obstacle, int what, const Vec3& a, const Vec3& b, double need_m,
                         Seen& seen) const;
  double least_between_m(const DistanceBound& obstacle, int what, const Vec3& a, double at_a_m, const Vec3& b,
                         double at_b_m, double need_m, Seen& seen) const;
  double at_least_m(int capsule, double need_m, Seen& seen) const;
  double by_joints_m(int capsule, const Eigen::VectorXd& change) const;
  double by_base_m(const Eigen::VectorXd& change, double reach_m) const;
  /// How far off something has to be proven.
  double wanted_m(double allowed_m) const;
  void prove(const Eigen::VectorXd& from, const Eigen::VectorXd& step, double middle, double half,
             const std::vector<int>& open, const std::vector<double>& tolerance_m);
  void note(int capsule, const Seen& seen, double at);
  void prove_pairs(const std::vector<Eigen::VectorXd>& path, const std::vector<double>& tolerance_m);
  /// The least gap that is proven between two postures, from the gaps at both; below `allowed` it did not
  /// succeed.
  double prove_pair(std::size_t pair, const Eigen::VectorXd& from, const Eigen::VectorXd& to,
                    double at_from_m, double at_to_m, double allowed_m, double begin, double end, int depth);
  double pair_gap_m(std::size_t pair) const;
  double pair_travel_m(std::size_t pair, const Eigen::VectorXd& change) const;

  const Mover& mover_;
  const Obstacles obstacles_;
  std::vector<DistanceBound> bounds_;  ///< of the fields
  const std::vector<std::pair<int, int>> pairs_;
  const ProofRule rule_;
  std::vector<std::vector<Lever>> levers_;  ///< of each capsule, from its link down to the base
  std::vector<double> furthest_m_;          ///< of each capsule's axis from H, whatever the posture
  Eigen::MatrixXd pair_levers_m_;           ///< pairs x dofs: of joints that move one and not the other
  std::vector<Pose> X_HL_;
  Eigen::VectorXd q_;
  Pose X_OH_ = Pose::Identity();
  std::vector<hands::PlacedCapsule> placed_;
  Eigen::VectorXd reach_m_;  ///< of each capsule's axis from H, at the last posture
  Eigen::VectorXd known_m_;  ///< of each capsule: at least so far off at the last waypoint that was proven
  Certificate answer_;
  double proven_m_ = 0, seen_m_ = 0;
  int waypoint_ = 0;
  bool measure_ = true;  ///< prove the least clearance too, not only what is asked
};

}  // namespace geocage::motion
