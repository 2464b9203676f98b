#include "stages/place/pose_search.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "hands/caging.h"
#include "hands/closing.h"

namespace geocage::stages {

using geometry::Pose;
using geometry::Vec3;
using hands::PlacedCapsule;

namespace {

constexpr double margin_weight = 0.3;  // of the closure margin beside the blocked share (README)
constexpr int most_lifts = 4;          // closing changes with the height, so one lift may call for another
constexpr double lift_slack_m = 0.001;
constexpr double palm_dent_m =
    0.01;  // how far a tip may reach between the palm's capsules before it touches one

/// Columns x, y, z of the right-handed frame with z = `approach` and y = `flexion`, both unit and
/// perpendicular.
Eigen::Matrix3d hand_frame(const Vec3& approach, const Vec3& flexion) {
  Eigen::Matrix3d frame;
  frame << flexion.cross(approach), flexion, approach;
  return frame;
}

/// Posture on the way from open to closed where the joints of `rank` have gone `share` of theirs; lower ranks
/// first.
Eigen::VectorXd on_the_way(const hands::Hand& hand, const Eigen::VectorXd& open,
                           const Eigen::VectorXd& closed, std::size_t rank, double share) {
  Eigen::VectorXd q = open;
  for (const hands::Finger& finger : hand.fingers)
    for (std::size_t i = 0; i < finger.dofs.size() && i <= rank; ++i) {
      const int d = finger.dofs[i];
      q[d] += (i < rank ? 1 : share) * (closed[d] - open[d]);
    }
  return q;
}

}  // namespace

PoseSearch::PoseSearch(const PlaceParams& params, const geometry::SignedDistanceField& field,
                       const std::optional<geometry::Plane>& support, const Vec3& center_of_mass_O,
                       const hands::Hand& hand)
    : params_(params), field_(field), support_(support), center_of_mass_O_(center_of_mass_O), hand_(hand) {
  const auto moves = [&](int link) {
    return std::any_of(hand.fingers.begin(), hand.fingers.end(), [&](const hands::Finger& finger) {
      return std::find(finger.links.begin(), finger.links.end(), link) != finger.links.end();
    });
  };
  const auto all = capsules(Pose::Identity(), hand.open_rad);
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (moves(hand.capsules[i].link)) continue;
    base_.push_back(static_cast<int>(i));
    for (const Vec3& end : {all[i].a, all[i].b})
      far_m_ = std::max(far_m_, (end - hand.palm_H).norm() + all[i].radius_m);
  }
  const Eigen::Vector3i cells(field.nodes[0] - 1, field.nodes[1] - 1, field.nodes[2] - 1);
  far_m_ += field.cell_m * cells.cast<double>().norm();
}

std::vector<PlacedCapsule> PoseSearch::capsules(const Pose& X_OH, const Eigen::VectorXd& q) const {
  std::vector<Pose> X_HL;
  std::vector<PlacedCapsule> placed;
  hands::forward_kinematics(hand_.tree, q, X_HL);
  hands::place_capsules(hand_, X_OH, X_HL, placed);
  return placed;
}

std::optional<PoseSearch::Way> PoseSearch::way(const topology::Candidate& candidate,
                                               const std::string& approach) const {
  Vec3 direction = -candidate.n_O;
  if (approach == "center") {
    direction = candidate.center_O - candidate.p_O;
    direction -= direction.dot(candidate.axis_O) * candidate.axis_O;
  }
  if (direction.norm() < 0.001) return std::nullopt;  // the centre lies on the surface
  direction.normalize();
  return Way{direction, direction.cross(center_of_mass_O_ - candidate.p_O).norm()};
}

/// The hand on the line through the candidate, its palm towards it, where palm or knuckles first touch.
std::optional<Pose> PoseSearch::first_contact(const topology::Candidate& candidate, const Vec3& approach_O,
                                              double roll_rad) const {
  Vec3 flexion_O = candidate.axis_O - candidate.axis_O.dot(approach_O) * approach_O;
  if (flexion_O.norm() < 0.1) flexion_O = approach_O.unitOrthogonal();
  flexion_O = Eigen::AngleAxisd(roll_rad, approach_O) * flexion_O.normalized();
  Pose X_OH = Pose::Identity();
  X_OH.linear() =
      hand_frame(approach_O, flexion_O) * hand_frame(hand_.approach_H, hand_.flexion_axis_H).transpose();
  X_OH.translation() = candidate.p_O - far_m_ * approach_O - X_OH.linear() * hand_.palm_H;
  const auto all = capsules(X_OH, hand_.open_rad);
  std::vector<PlacedCapsule> base;
  for (int i : base_) base.push_back(all[i]);
  const auto travel_m = hands::free_travel_m(field_, base, approach_O, far_m_ + palm_dent_m);
  if (!travel_m) return std::nullopt;
  X_OH.translation() += *travel_m * approach_O;
  return X_OH;
}

/// The open posture, its first joints opened further until the whole hand is free.
std::optional<Eigen::VectorXd> PoseSearch::free_preshape(const Pose& X_OH, double spread_rad) const {
  const auto& tree = hand_.tree;
  Eigen::VectorXd q = hand_.open_rad;
  if (!hand_.spread_dof.empty()) {
    const int d = tree.dof(hand_.spread_dof);
    q[d] = std::clamp(spread_rad, tree.lower_rad[d], tree.upper_rad[d]);
  }
  for (;;) {
    const auto placed = capsules(X_OH, q);
    const auto free = [&](const PlacedCapsule& capsule) {
      return hands::capsule_distance(field_, capsule).distance_m >= params_.open_clearance_m;
    };
    if (std::all_of(placed.begin(), placed.end(), free)) return q;
    const Eigen::VectorXd before = q;
    for (const hands::Finger& finger : hand_.fingers) {
      const int d = finger.dofs.front();
      q[d] = std::clamp(q[d] - params_.opening_step_rad * hand_.closing_rad[d], tree.lower_rad[d],
                        tree.upper_rad[d]);
    }
    if (q == before) return std::nullopt;
  }
}

/// Lowest point of the hand over the support while it closes; infinite without support.
double PoseSearch::lowest_m(const Pose& X_OH, const Eigen::VectorXd& open,
                            const Eigen::VectorXd& closed) const {
  constexpr int samples = 8;
  double lowest = std::numeric_limits<double>::infinity();
  if (!support_) return lowest;
  std::size_t ranks = 0;
  for (const hands::Finger& finger : hand_.fingers) ranks = std::max(ranks, finger.dofs.size());
  for (std::size_t rank = 0; rank < ranks; ++rank)
    for (int k = 0; k <= samples; ++k)
      for (const PlacedCapsule& capsule :
           capsules(X_OH, on_the_way(hand_, open, closed, rank, k / double{samples})))
        lowest = std::min({lowest, support_->height_m(capsule.a) - capsule.radius_m,
                           support_->height_m(capsule.b) - capsule.radius_m});
  return lowest;
}

/// Opens and closes the hand at X_OH, lifting it off the support where it comes too near.
std::string PoseSearch::close_above_support(Pose& X_OH, double spread_rad, Closing& closing) const {
  for (int attempt = 0; attempt < most_lifts; ++attempt) {
    const auto open = free_preshape(X_OH, spread_rad);
    if (!open) return "open hand collides";
    closing.open = *open;
    double missing_m = params_.support_clearance_m - lowest_m(X_OH, *open, *open);
    if (missing_m <= 0) {
      closing.hand = hands::close_hand(hand_, field_, X_OH, *open, {});
      missing_m = params_.support_clearance_m - lowest_m(X_OH, *open, closing.hand.q);
    }
    if (missing_m <= 0) return {};
    closing.lift_m += missing_m + lift_slack_m;
    if (closing.lift_m > params_.max_lift_m) break;
    X_OH.translation() += (missing_m + lift_slack_m) * support_->normal;
  }
  return "too near the support";
}

std::string PoseSearch::try_pose(Pose X_OH, double spread_rad, hands::Grasp& grasp) const {
  Closing closing;
  const std::string rule = close_above_support(X_OH, spread_rad, closing);
  if (!rule.empty()) return rule;
  const hands::ClosedHand& closed = closing.hand;
  const int needed = std::min(params_.min_fingers, static_cast<int>(hand_.fingers.size()));
  if (closed.fingers_touching < needed) return "too few fingers touch";
  if (closed.penetration_m > params_.max_penetration_m) return "penetrates";
  const double blocked = hands::blocked_share(field_, capsules(X_OH, closed.q));
  if (blocked < params_.min_blocked_share) return "leaves a way out";
  const double margin = hands::closure_margin(closed.contacts);
  grasp.hand = hand_.name;
  grasp.object = params_.object;
  grasp.X_OH = hands::file_pose(X_OH);
  grasp.joints_rad = hands::joint_map(hand_.tree, closed.q);
  grasp.pregrasp_joints_rad = hands::joint_map(hand_.tree, closing.open);
  grasp.scores = {{"rank", blocked + margin_weight * margin},
                  {"blocked_share", blocked},
                  {"closure_margin", margin},
                  {"fingers", closed.fingers_touching},
                  {"contacts", static_cast<double>(closed.contacts.size())},
                  {"penetration_m", closed.penetration_m},
                  {"lift_m", closing.lift_m}};
  return {};
}

CandidatePoses PoseSearch::search(const topology::Candidate& candidate, double ball_radius_m) const {
  CandidatePoses poses;
  const int rolls = candidate.heuristic == "winding" ? params_.rolls_winding : params_.rolls_curvature;
  const int poses_a_roll = static_cast<int>(params_.gaps_m.size() * params_.spreads_rad.size());
  const auto reject = [&](const std::string& rule, int count) { poses.rejected[rule] += count; };
  for (const std::string& approach : params_.approaches) {
    poses.tried += rolls * poses_a_roll;
    const auto line = way(candidate, approach);
    if (!line || line->com_offset_m > params_.max_com_offset_m) {
      reject(line ? "far from the centre of mass" : "no direction to the ball's centre",
             rolls * poses_a_roll);
      continue;
    }
    for (int roll = 0; roll < rolls; ++roll) {
      const double roll_rad = 2 * std::numbers::pi * roll / rolls;
      const auto contact = first_contact(candidate, line->approach_O, roll_rad);
      if (!contact) reject("palm meets nothing", poses_a_roll);
      for (std::size_t i = 0; contact && i < params_.gaps_m.size(); ++i)
        for (double spread_rad : params_.spreads_rad) {
          Pose X_OH = *contact;
          X_OH.translation() -= params_.gaps_m[i] * line->approach_O;
          hands::Grasp grasp;
          const std::string rule = try_pose(X_OH, spread_rad, grasp);
          if (!rule.empty()) {
            reject(rule, 1);
            continue;
          }
          grasp.heuristic = candidate.heuristic;
          grasp.scores.merge(std::map<std::string, double>{{"score", candidate.score},
                                                           {"vertex", candidate.vertex},
                                                           {"winding_angle_rad", candidate.winding_angle_rad},
                                                           {"curvature_sum_rad", candidate.curvature_sum_rad},
                                                           {"euler", candidate.euler},
                                                           {"ball_radius_m", ball_radius_m},
                                                           {"com_offset_m", line->com_offset_m},
                                                           {"gap_m", params_.gaps_m[i]},
                                                           {"roll_rad", roll_rad},
                                                           {"spread_rad", spread_rad}});
          poses.grasps.push_back(std::move(grasp));
        }
    }
  }
  return poses;
}

}  // namespace geocage::stages
