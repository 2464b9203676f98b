#include "motion/certificate.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace geocage::motion {

using Eigen::VectorXd;

namespace {

constexpr double infinite = std::numeric_limits<double>::infinity();
constexpr double float_slack_m = 1e-7;  ///< nodes are stored as floats: 2^-24 of at most a metre
constexpr double far_m = 1;             ///< no need to know more of a distance
constexpr double least_piece_m = 1e-4;  ///< of an axis; half of it is lost to the bound

/// sum over corners of weight x squared distance from the point, in units of the cell: h^2 sum f (1 - f).
double spread(const Vec3& fraction) {
  return (fraction.array() * (1 - fraction.array())).sum();
}

/// How far a point of each capsule's axis can be from the axis of each joint, whatever the posture.
Eigen::MatrixXd levers(const hands::Hand& hand) {
  const auto& tree = hand.tree;
  Eigen::MatrixXd bound = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(hand.capsules.size()), tree.dofs());
  for (std::size_t i = 0; i < hand.capsules.size(); ++i) {
    const auto& capsule = hand.capsules[i];
    double reach = std::max(capsule.a_L.norm(), capsule.b_L.norm());
    for (int link = capsule.link; link > 0;) {
      const auto& joint = tree.joints[static_cast<std::size_t>(link) - 1];
      if (joint.type == hands::Joint::Type::revolute)
        bound(static_cast<Eigen::Index>(i), joint.dof) += std::abs(joint.multiplier) * reach;
      if (joint.type == hands::Joint::Type::prismatic) {
        bound(static_cast<Eigen::Index>(i), joint.dof) += std::abs(joint.multiplier);
        reach += std::max(std::abs(joint.lower_rad), std::abs(joint.upper_rad));
      }
      reach += joint.X_PJ.translation().norm();
      link = joint.parent_link;
    }
  }
  return bound;
}

}  // namespace

double distance_at_least_m(const geometry::SignedDistanceField& field, const Vec3& p_O) {
  const Vec3 cells(field.nodes[0] - 1, field.nodes[1] - 1, field.nodes[2] - 1);
  const Vec3 wanted = (p_O - field.origin) / field.cell_m;
  const Vec3 inside = wanted.cwiseMax(0).cwiseMin(cells);
  const double away = (wanted - inside).norm() * field.cell_m;
  const auto [h, fraction] = field.cell_at(p_O);
  const double value = field.value(p_O) - away - float_slack_m;
  const double error2 = h * h * spread(fraction), error = std::sqrt(error2);
  const double d = value > error ? std::sqrt(value * value - error2) : value - error;
  return away > 0 ? std::hypot(std::max(d, 0.0), away) : d;
}

Prover::Prover(const FloatingHand& hand, const geometry::SignedDistanceField& field,
               const std::optional<geometry::Plane>& support, const ProofRule& rule)
    : hand_(hand), field_(field), support_(support), rule_(rule), levers_m_(levers(hand.hand())) {
  reach_m_.resize(levers_m_.rows());
}

void Prover::look_at(const VectorXd& x) {
  const hands::Hand& hand = hand_.hand();
  hands::forward_kinematics(hand.tree, hand_.joints(x), X_HL_);
  const Pose X_OH = hand_.pose(x);
  hands::place_capsules(hand, X_OH, X_HL_, placed_);
  for (Eigen::Index i = 0; i < reach_m_.size(); ++i) {
    const auto& c = placed_[static_cast<std::size_t>(i)];
    reach_m_[i] = std::max((c.a - X_OH.translation()).norm(), (c.b - X_OH.translation()).norm());
  }
  ++answer_.postures;
}

double Prover::travel_m(int capsule, const VectorXd& change) const {
  const double by_joints = levers_m_.row(capsule).dot(change.tail(levers_m_.cols()).cwiseAbs());
  // |left Jacobian| <= 1, so the base turns by at most |dw|; what it turns has grown by `by_joints` at most.
  return FloatingHand::unit_m * change.head<3>().norm() +
         change.segment<3>(3).norm() * (reach_m_[capsule] + by_joints) + by_joints;
}

/// A lower bound of the distance along the axis; pieces are halved until they reach `need_m` or can't.
double Prover::least_on_axis_m(const Vec3& a, const Vec3& b, double need_m, double& seen_m) const {
  const Vec3 middle = (a + b) / 2;
  const double half = (b - a).norm() / 2, d = distance_at_least_m(field_, middle);
  seen_m = std::min(seen_m, d);
  if (d - half >= need_m || d < need_m || half < least_piece_m) return d - half;
  return std::min(least_on_axis_m(a, middle, need_m, seen_m), least_on_axis_m(middle, b, need_m, seen_m));
}

double Prover::at_least_m(int capsule, double need_m, double& seen_m) const {
  const auto& c = placed_[static_cast<std::size_t>(capsule)];
  seen_m = infinite;
  double least = least_on_axis_m(c.a, c.b, need_m + c.radius_m, seen_m);
  if (support_) {
    const double height = std::min(support_->height_m(c.a), support_->height_m(c.b));
    least = std::min(least, height);
    seen_m = std::min(seen_m, height);
  }
  seen_m -= c.radius_m;
  return least - c.radius_m;
}

void Prover::note(int capsule, double seen_m, double at) {
  if (seen_m >= seen_m_) return;
  seen_m_ = seen_m;
  answer_.at = at;
  answer_.link = hand_.hand().capsules[static_cast<std::size_t>(capsule)].link;
}

void Prover::prove(const VectorXd& from, const VectorXd& step, double middle, double half,
                   const std::vector<int>& open, const std::vector<double>& tolerance_m) {
  look_at(from + middle * step);
  const VectorXd change = half * step;
  std::vector<int> left;
  for (int i : open) {
    const auto link = static_cast<std::size_t>(hand_.hand().capsules[static_cast<std::size_t>(i)].link);
    const double travel = travel_m(i, change);
    const double wanted = std::max(-tolerance_m[link], seen_m_ - rule_.resolution_m);
    double seen;
    const double least = at_least_m(i, wanted + travel, seen) - travel;
    note(i, seen, waypoint_ + middle);
    if (least >= wanted) {
      proven_m_ = std::min(proven_m_, least);
      continue;
    }
    at_least_m(i, -tolerance_m[link],
               seen);  // the search above ended at the first point below what it wanted
    note(i, seen, waypoint_ + middle);
    if (seen < -tolerance_m[link]) {
      answer_.outcome = Proof::collides;
      return;
    }
    left.push_back(i);
  }
  if (left.empty()) return;
  if (half < std::ldexp(1.0, -rule_.bisections)) {
    answer_.outcome = Proof::undecided;
    return;
  }
  for (double side : {-0.5, 0.5}) {
    if (answer_.outcome != Proof::free) return;
    prove(from, step, middle + side * half, half / 2, left, tolerance_m);
  }
}

Certificate Prover::certify(const std::vector<VectorXd>& path, const std::vector<double>& tolerance_m) {
  answer_ = {};
  proven_m_ = seen_m_ = infinite;
  std::vector<int> all(hand_.hand().capsules.size());
  std::iota(all.begin(), all.end(), 0);
  // Waypoints first: the nearer the least clearance is known, the sooner the rest is proven to be above it.
  for (std::size_t t = 0; t < path.size(); ++t) {
    look_at(path[t]);
    for (int i : all) {
      double seen;
      at_least_m(i, std::min(seen_m_, far_m), seen);
      note(i, seen, static_cast<double>(t));
    }
  }
  for (waypoint_ = 0; waypoint_ + 1 < static_cast<int>(path.size()); ++waypoint_) {
    if (answer_.outcome != Proof::free) break;
    const auto t = static_cast<std::size_t>(waypoint_);
    prove(path[t], path[t + 1] - path[t], 0.5, 0.5, all, tolerance_m);
  }
  answer_.clearance_m = answer_.outcome == Proof::free ? proven_m_ : seen_m_;
  return answer_;
}

bool Prover::posture_free(const VectorXd& x, double clearance_m) {
  look_at(x);
  double seen;
  for (int i = 0; i < static_cast<int>(placed_.size()); ++i)
    if (at_least_m(i, clearance_m, seen) < clearance_m) return false;
  return true;
}

}  // namespace geocage::motion
