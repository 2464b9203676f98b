#include "motion/certificate.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "hands/closing.h"

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

}  // namespace

DistanceBound::DistanceBound(const geometry::SignedDistanceField& field, double node_excess_m)
    : field_(&field), excess_m_(node_excess_m), low_O_(field.origin), high_O_(field.origin) {
  const auto& n = field.nodes;
  const std::ptrdiff_t stride[] = {1, n[0], std::ptrdiff_t(n[0]) * n[1]};
  const double error2 = field.cell_m * field.cell_m / 2;  // on a face two coordinates lie between nodes
  for (int axis = 0; axis < 3; ++axis) {
    high_O_[axis] += field.cell_m * (n[static_cast<std::size_t>(axis)] - 1);
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    const auto inward_m = [&](std::ptrdiff_t at) {
      double least = infinite;
      for (int j = 0; j < n[static_cast<std::size_t>(v)]; ++j)
        for (int i = 0; i < n[static_cast<std::size_t>(u)]; ++i)
          least = std::min<double>(
              least, field.coarse[static_cast<std::size_t>(at + i * stride[u] + j * stride[v])]);
      const double value = least - float_slack_m - node_excess_m;
      return value > 0 ? std::sqrt(std::max(0.0, value * value - error2)) : 0;
    };
    const double low_m = inward_m(0),
                 high_m = inward_m((n[static_cast<std::size_t>(axis)] - 1) * stride[axis]);
    low_O_[axis] += low_m;
    high_O_[axis] -= high_m;
  }
}

double DistanceBound::at_least_m(const Vec3& p_O) const {
  const auto cell = field_->cell_at(p_O);
  const double value = cell.value - float_slack_m - excess_m_;
  const double error2 = cell.side_m * cell.side_m * spread(cell.fraction), error = std::sqrt(error2);
  const double d = value > error ? std::sqrt(value * value - error2) : value - error;
  if (cell.away_m == 0) return d;
  const double beside2 = std::max(d, 0.0) * std::max(d, 0.0) + cell.away_m * cell.away_m,
               box2 = (p_O - p_O.cwiseMax(low_O_).cwiseMin(high_O_)).squaredNorm();
  return std::sqrt(std::max(beside2, box2));
}

Prover::Prover(const Mover& mover, const Obstacles& obstacles, std::vector<std::pair<int, int>> self_pairs,
               const ProofRule& rule)
    : mover_(mover), obstacles_(obstacles), pairs_(std::move(self_pairs)), rule_(rule) {
  for (const ObstacleField& obstacle : obstacles_.fields)
    bounds_.emplace_back(*obstacle.field, obstacle.node_excess_m);
  const auto& tree = mover.hand().tree;
  for (const auto& capsule : mover.hand().capsules) {
    // How far a point of its axis can be from the axis of each joint, whatever the posture.
    std::vector<Lever> levers;
    double reach = std::max(capsule.a_L.norm(), capsule.b_L.norm());
    for (int link = capsule.link; link > 0;) {
      const auto& joint = tree.joints[static_cast<std::size_t>(link) - 1];
      const bool slides = joint.type == hands::Joint::Type::prismatic;
      if (joint.type != hands::Joint::Type::fixed)
        levers.push_back({link, joint.dof, slides, std::abs(joint.multiplier), slides ? 1 : reach});
      if (slides) reach += std::max(std::abs(joint.lower_rad), std::abs(joint.upper_rad));
      reach += joint.X_PJ.translation().norm();
      link = joint.parent_link;
    }
    levers_.push_back(std::move(levers));
    furthest_m_.push_back(reach);
  }
  reach_m_.resize(static_cast<Eigen::Index>(levers_.size()));
  pair_levers_m_.setZero(static_cast<Eigen::Index>(pairs_.size()), tree.dofs());
  for (std::size_t k = 0; k < pairs_.size(); ++k) {
    const auto &a = levers_[static_cast<std::size_t>(pairs_[k].first)],
               &b = levers_[static_cast<std::size_t>(pairs_[k].second)];
    // Joints that carry both move neither against the other. They are the last ones of both lists.
    const auto add = [&](const std::vector<Lever>& own, const std::vector<Lever>& others) {
      for (const Lever& lever : own)
        if (std::none_of(others.begin(), others.end(), [&](const Lever& o) { return o.link == lever.link; }))
          pair_levers_m_(static_cast<Eigen::Index>(k), lever.dof) += lever.multiplier * lever.reach_m;
    };
    add(a, b);
    add(b, a);
  }
}

void Prover::look_at(const VectorXd& x) {
  const hands::Hand& hand = mover_.hand();
  q_ = mover_.joints(x);
  hands::forward_kinematics(hand.tree, q_, X_HL_);
  X_OH_ = mover_.pose(x);
  hands::place_capsules(hand, X_OH_, X_HL_, placed_);
  for (Eigen::Index i = 0; i < reach_m_.size(); ++i) {
    const auto& c = placed_[static_cast<std::size_t>(i)];
    reach_m_[i] = std::max((c.a - X_OH_.translation()).norm(), (c.b - X_OH_.translation()).norm());
  }
  ++answer_.postures;
}

double Prover::by_joints_m(int capsule, const VectorXd& change) const {
  const int base = mover_.base_dofs();
  double moved = 0;
  for (const Lever& lever : levers_[static_cast<std::size_t>(capsule)])
    moved += std::abs(change[base + lever.dof]) * lever.multiplier * lever.reach_m;
  return moved;
}

double Prover::by_base_m(const VectorXd& change, double reach_m) const {
  // |left Jacobian| <= 1, so the base turns by at most |dw|.
  return Mover::unit_m * change.head<3>().norm() + change.segment<3>(3).norm() * reach_m;
}

double Prover::travel_m(int capsule, const VectorXd& change) const {
  const double by_joints = by_joints_m(capsule, change);
  if (!mover_.floats()) return by_joints;
  return by_joints + by_base_m(change, reach_m_[capsule] + by_joints);  // it grows by what joints move
}

double Prover::any_travel_m(int capsule, const VectorXd& change) const {
  const double by_joints = by_joints_m(capsule, change);
  if (!mover_.floats()) return by_joints;
  return by_joints + by_base_m(change, furthest_m_[static_cast<std::size_t>(capsule)]);
}

double Prover::near_travel_m(int capsule, const VectorXd& change) const {
  const int base = mover_.base_dofs();
  const auto& c = placed_[static_cast<std::size_t>(capsule)];
  const auto& tree = mover_.hand().tree;
  double by_joints = 0, beyond = 0;  // `beyond`: moved by joints nearer to the capsule, at most
  for (const Lever& lever : levers_[static_cast<std::size_t>(capsule)]) {
    const double turn = std::abs(change[base + lever.dof]) * lever.multiplier;
    if (turn == 0) continue;
    double reach = lever.reach_m;
    if (!lever.slides) {
      const Pose X_OL = X_OH_ * X_HL_[static_cast<std::size_t>(lever.link)];
      const Vec3 axis = X_OL.linear() * tree.joints[static_cast<std::size_t>(lever.link) - 1].axis_J,
                 at = X_OL.translation();
      reach = std::min(reach, std::max(axis.cross(c.a - at).norm(), axis.cross(c.b - at).norm()) + beyond);
    }
    by_joints += turn * reach;
    beyond += turn * lever.reach_m;
  }
  if (!mover_.floats()) return by_joints;
  return by_joints + by_base_m(change, reach_m_[capsule] + by_joints);
}

/// A lower bound of the distance between two points of an axis, from that at both: pieces are halved until
/// they reach `need_m` or can't.
double Prover::least_between_m(const DistanceBound& obstacle, int what, const Vec3& a, double at_a_m,
                               const Vec3& b, double at_b_m, double need_m, Seen& seen) const {
  const double length = (b - a).norm(), least = (at_a_m + at_b_m - length) / 2;
  if (least >= need_m || std::min(at_a_m, at_b_m) < need_m || length < least_piece_m) return least;
  const Vec3 middle = (a + b) / 2;
  const double d = obstacle.at_least_m(middle);
  seen.take(d, what);
  const double first = least_between_m(obstacle, what, a, at_a_m, middle, d, need_m, seen);
  if (first < need_m) return std::min(first, (d + at_b_m - length / 2) / 2);
  return std::min(first, least_between_m(obstacle, what, middle, d, b, at_b_m, need_m, seen));
}

double Prover::least_on_axis_m(const DistanceBound& obstacle, int what, const Vec3& a, const Vec3& b,
                               double need_m, Seen& seen) const {
  const Vec3 middle = (a + b) / 2;
  const double half = (b - a).norm() / 2, d = obstacle.at_least_m(middle);
  seen.take(d, what);
  if (d - half >= need_m || d < need_m || half < least_piece_m) return d - half;
  const double at_a = obstacle.at_least_m(a), at_b = obstacle.at_least_m(b);
  seen.take(at_a, what);
  seen.take(at_b, what);
  return std::min(least_between_m(obstacle, what, a, at_a, middle, d, need_m, seen),
                  least_between_m(obstacle, what, middle, d, b, at_b, need_m, seen));
}

double Prover::at_least_m(int capsule, double need_m, Seen& seen) const {
  const auto& c = placed_[static_cast<std::size_t>(capsule)];
  seen = {};
  double least = infinite;
  int what = Certificate::of_object;
  for (const DistanceBound& obstacle : bounds_) {
    least = std::min(least, least_on_axis_m(obstacle, what, c.a, c.b, need_m + c.radius_m, seen));
    what = what == Certificate::of_object ? Certificate::of_support - 1 : what - 1;
  }
  if (obstacles_.support) {
    const double height = std::min(obstacles_.support->height_m(c.a), obstacles_.support->height_m(c.b));
    least = std::min(least, height);
    seen.take(height, Certificate::of_support);
  }
  seen.distance_m -= c.radius_m;
  return least - c.radius_m;
}

void Prover::note(int capsule, const Seen& seen, double at) {
  if (seen.distance_m >= seen_m_) return;
  seen_m_ = seen.distance_m;
  answer_.at = at;
  answer_.link = mover_.hand().capsules[static_cast<std::size_t>(capsule)].link;
  answer_.other = seen.other;
}

double Prover::wanted_m(double allowed_m) const {
  return measure_ ? std::max(allowed_m, seen_m_ - rule_.resolution_m) : allowed_m;
}

void Prover::prove(const VectorXd& from, const VectorXd& step, double middle, double half,
                   const std::vector<int>& open, const std::vector<double>& tolerance_m) {
  look_at(from + middle * step);
  const VectorXd change = half * step;
  std::vector<int> left;
  for (int i : open) {
    const auto link = static_cast<std::size_t>(mover_.hand().capsules[static_cast<std::size_t>(i)].link);
    const double allowed = -tolerance_m[link], wanted = wanted_m(allowed);
    double travel = travel_m(i, change);
    Seen seen;
    double least = at_least_m(i, wanted + travel, seen);
    note(i, seen, waypoint_ + middle);
    if (least - travel < wanted) {
      travel = near_travel_m(i, change);
      least = at_least_m(i, wanted + travel, seen);
      note(i, seen, waypoint_ + middle);
    }
    least -= travel;
    if (least >= wanted) {
      proven_m_ = std::min(proven_m_, least);
      if (half == 0.5) known_m_[i] = least;
      continue;
    }
    // The search above ended at the first point below what it wanted.
    if (measure_) at_least_m(i, allowed, seen);
    note(i, seen, waypoint_ + middle);
    if (seen.distance_m < allowed) {
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

double Prover::pair_gap_m(std::size_t pair) const {
  return hands::capsule_gap_m(placed_[static_cast<std::size_t>(pairs_[pair].first)],
                              placed_[static_cast<std::size_t>(pairs_[pair].second)]);
}

double Prover::pair_travel_m(std::size_t pair, const VectorXd& change) const {
  return pair_levers_m_.row(static_cast<Eigen::Index>(pair))
      .dot(change.tail(pair_levers_m_.cols()).cwiseAbs());
}

double Prover::prove_pair(std::size_t pair, const VectorXd& from, const VectorXd& to, double at_from_m,
                          double at_to_m, double allowed_m, double begin, double end, int depth) {
  // At any moment the gap is at least that of either end less what was travelled from there: at worst half of
  // (both gaps - all the way).
  const double least = (at_from_m + at_to_m - pair_travel_m(pair, to - from)) / 2;
  if (std::min({least, at_from_m, at_to_m}) >= allowed_m) return std::min({least, at_from_m, at_to_m});
  if (std::min(at_from_m, at_to_m) < allowed_m || depth == 0) {
    answer_.outcome = std::min(at_from_m, at_to_m) < allowed_m ? Proof::collides : Proof::undecided;
    answer_.at = begin;
    answer_.link = mover_.hand().capsules[static_cast<std::size_t>(pairs_[pair].first)].link;
    answer_.other = mover_.hand().capsules[static_cast<std::size_t>(pairs_[pair].second)].link;
    return std::min(at_from_m, at_to_m);
  }
  const VectorXd middle = (from + to) / 2;
  look_at(middle);
  const double gap = pair_gap_m(pair), half = (begin + end) / 2;
  const double first = prove_pair(pair, from, middle, at_from_m, gap, allowed_m, begin, half, depth - 1);
  if (answer_.outcome != Proof::free) return first;
  return std::min(first, prove_pair(pair, middle, to, gap, at_to_m, allowed_m, half, end, depth - 1));
}

void Prover::prove_pairs(const std::vector<VectorXd>& path, const std::vector<double>& tolerance_m) {
  answer_.self_clearance_m = far_m;
  if (pairs_.empty() || path.empty()) return;
  // Gaps are looked at only where what is known of them has been travelled up: a lower bound is as good.
  std::vector<double> known(pairs_.size());
  std::vector<std::size_t> seen_at(pairs_.size(), 0), open;  // `known` is the gap itself at this waypoint
  std::vector<double> here;
  VectorXd travel(pair_levers_m_.rows());
  look_at(path.front());
  for (std::size_t k = 0; k < pairs_.size(); ++k) known[k] = pair_gap_m(k);
  const auto link = [&](int capsule) {
    return static_cast<std::size_t>(mover_.hand().capsules[static_cast<std::size_t>(capsule)].link);
  };
  const auto allowed = [&](std::size_t k) {
    return std::min(0.0, -std::min(tolerance_m[link(pairs_[k].first)], tolerance_m[link(pairs_[k].second)]));
  };
  for (std::size_t t = 0; t + 1 < path.size(); ++t) {
    travel.noalias() = pair_levers_m_ * (path[t + 1] - path[t]).tail(pair_levers_m_.cols()).cwiseAbs();
    open.clear();
    for (std::size_t k = 0; k < pairs_.size(); ++k) {
      const double least = known[k] - travel[static_cast<Eigen::Index>(k)];
      if (least < rule_.resolution_m) {
        open.push_back(k);
        continue;
      }
      known[k] = least;
      answer_.self_clearance_m = std::min(answer_.self_clearance_m, least);
    }
    if (open.empty()) continue;
    if (std::any_of(open.begin(), open.end(), [&](std::size_t k) { return seen_at[k] != t; })) {
      look_at(path[t]);
      for (std::size_t k : open) known[k] = pair_gap_m(k);
    }
    here = known;
    look_at(path[t + 1]);
    for (std::size_t k : open) {
      known[k] = pair_gap_m(k);
      seen_at[k] = t + 1;
    }
    for (std::size_t k : open) {
      const double least = prove_pair(k, path[t], path[t + 1], here[k], known[k], allowed(k),
                                      static_cast<double>(t), static_cast<double>(t) + 1, rule_.bisections);
      answer_.self_clearance_m = std::min(answer_.self_clearance_m, least);
      if (answer_.outcome != Proof::free) return;
    }
  }
}

Certificate Prover::certify(const std::vector<VectorXd>& path, const std::vector<double>& tolerance_m) {
  if (path.size() == 1) return certify({path[0], path[0]}, tolerance_m);
  answer_ = {};
  proven_m_ = seen_m_ = infinite;
  // Nothing is looked at again before what was known of its distance is travelled up.
  known_m_.setConstant(static_cast<Eigen::Index>(levers_.size()), -infinite);
  std::vector<int> all(levers_.size()), open;
  std::iota(all.begin(), all.end(), 0);
  // Waypoints first: the nearer the least clearance is known, the sooner the rest is proven to be above it.
  for (std::size_t t = 0; measure_ && t < path.size(); ++t) {
    look_at(path[t]);
    for (int i : all) {
      Seen seen;
      at_least_m(i, std::min(seen_m_, far_m), seen);
      note(i, seen, static_cast<double>(t));
    }
  }
  for (waypoint_ = 0; waypoint_ + 1 < static_cast<int>(path.size()); ++waypoint_) {
    if (answer_.outcome != Proof::free) break;
    const auto t = static_cast<std::size_t>(waypoint_);
    const VectorXd step = path[t + 1] - path[t];
    open.clear();
    for (int i : all) {
      const auto link = static_cast<std::size_t>(mover_.hand().capsules[static_cast<std::size_t>(i)].link);
      known_m_[i] -= any_travel_m(i, step);
      if (known_m_[i] >= wanted_m(-tolerance_m[link])) {
        proven_m_ = std::min(proven_m_, known_m_[i]);
      } else {
        known_m_[i] = -infinite;
        open.push_back(i);
      }
    }
    if (!open.empty()) prove(path[t], step, 0.5, 0.5, open, tolerance_m);
    if (answer_.outcome == Proof::free) answer_.steps = waypoint_ + 1;
  }
  answer_.clearance_m = answer_.outcome == Proof::free ? proven_m_ : seen_m_;
  if (answer_.outcome == Proof::free) prove_pairs(path, tolerance_m);
  return answer_;
}

Certificate Prover::check(const std::vector<VectorXd>& path, const std::vector<double>& tolerance_m) {
  measure_ = false;
  const Certificate answer = certify(path, tolerance_m);
  measure_ = true;
  return answer;
}

bool Prover::frees(const std::vector<VectorXd>& path, const std::vector<double>& tolerance_m) {
  return check(path, tolerance_m).outcome == Proof::free;
}

bool Prover::touches(const VectorXd& x, const std::vector<double>& tolerance_m) {
  look_at(x);
  for (std::size_t i = 0; i < placed_.size(); ++i) {
    const auto& c = placed_[i];
    const double allowed = c.radius_m - tolerance_m[static_cast<std::size_t>(mover_.hand().capsules[i].link)],
                 half = (c.b - c.a).norm() / 2;
    for (const DistanceBound& obstacle : bounds_) {
      const double d = obstacle.at_least_m((c.a + c.b) / 2);
      if (d >= allowed + half) continue;
      if (std::min({d, obstacle.at_least_m(c.a), obstacle.at_least_m(c.b)}) < allowed) return true;
    }
    if (obstacles_.support &&
        std::min(obstacles_.support->height_m(c.a), obstacles_.support->height_m(c.b)) < allowed)
      return true;
  }
  return false;
}

bool Prover::posture_free(const VectorXd& x, double clearance_m) {
  look_at(x);
  Seen seen;
  for (int i = 0; i < static_cast<int>(placed_.size()); ++i)
    if (at_least_m(i, clearance_m, seen) < clearance_m) return false;
  for (std::size_t k = 0; k < pairs_.size(); ++k)
    if (pair_gap_m(k) < std::min(clearance_m, 0.0)) return false;
  return true;
}

bool Prover::posture_free(const VectorXd& x, const std::vector<double>& tolerance_m) {
  look_at(x);
  const auto allowed = [&](int capsule) {
    return -tolerance_m[static_cast<std::size_t>(
        mover_.hand().capsules[static_cast<std::size_t>(capsule)].link)];
  };
  Seen seen;
  for (int i = 0; i < static_cast<int>(placed_.size()); ++i)
    if (at_least_m(i, allowed(i), seen) < allowed(i)) return false;
  for (std::size_t k = 0; k < pairs_.size(); ++k)
    if (pair_gap_m(k) < std::min(std::max(allowed(pairs_[k].first), allowed(pairs_[k].second)), 0.0))
      return false;
  return true;
}

}  // namespace geocage::motion
