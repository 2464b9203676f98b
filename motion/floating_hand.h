#pragma once
#include <optional>
#include <vector>

#include "geometry/distance_field.h"
#include "hands/hand.h"
#include "motion/problem.h"

namespace geocage::motion {

using geometry::Pose;
using geometry::Vec3;

/// A hand that moves freely at an object. Its state is x = (u, w, q): X_OH = (p_goal + 0.1 m u, exp(w)
/// R_goal), so that all coordinates are of the size of an angle.
class FloatingHand {
 public:
  static constexpr double unit_m = 0.1;

  FloatingHand(const hands::Hand& hand, const Pose& goal_X_OH) : hand_(hand), goal_(goal_X_OH) {
    fill_balls();
  }

  int dim() const { return 6 + hand_.tree.dofs(); }
  const hands::Hand& hand() const { return hand_; }
  Eigen::VectorXd state(const Pose& X_OH, const Eigen::VectorXd& q) const;
  Pose pose(const Eigen::VectorXd& x) const;
  Eigen::VectorXd joints(const Eigen::VectorXd& x) const { return x.tail(hand_.tree.dofs()); }

  /// Balls on the capsules' axes, each inside its capsule, nearer to each other than their radius.
  struct Ball {
    int link;
    Vec3 p_L;
    double radius_m;
  };
  const std::vector<Ball>& balls() const { return balls_; }

  /// X_OL of every link, by way of `X_HL`; both are resized on first use only.
  void place_links(const Eigen::VectorXd& x, std::vector<Pose>& X_HL, std::vector<Pose>& X_OL) const;
  /// g' dp_O/dx of a point of `link` at p_O, for poses that place_links filled.
  Eigen::RowVectorXd gradient_row(const Eigen::VectorXd& x, const std::vector<Pose>& X_HL, int link,
                                  const Vec3& p_O, const Vec3& g) const;

 private:
  void fill_balls();
  const hands::Hand& hand_;
  Pose goal_;
  std::vector<Ball> balls_;
};

/// Hinge on each ball that is nearer than margin_m[t] to the object or to the support: e = 1 - d / margin, a
/// row a ball. `hand` and `field` must outlive the task.
Task clearance_task(const FloatingHand& hand, const geometry::SignedDistanceField& field,
                    const std::optional<geometry::Plane>& support, std::vector<double> margin_m,
                    std::vector<double> precision);

}  // namespace geocage::motion
