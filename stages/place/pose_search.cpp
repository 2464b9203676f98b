#include "stages/place/pose_search.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "hands/caging.h"
#include "hands/closing.h"
#include "hands/force_closure.h"
#include "hands/measures.h"
#include "topology/flux.h"
#include "topology/loops.h"

namespace geocage::stages {

using geometry::Pose;
using geometry::Vec3;
using hands::PlacedCapsule;

namespace {

constexpr int most_lifts = 4;  // closing changes with the height, so one lift may call for another
constexpr double lift_slack_m = 0.001;
constexpr int jaw_openings = 8;  // of a gripper, from open to nearly closed
constexpr double palm_dent_m =
    0.01;  // how far a tip may reach between the palm's capsules before it touches one

/// Columns x, y, z of the right-handed frame with z = `approach` and y = `flexion`, both unit and
/// perpendicular.
Eigen::Matrix3d hand_frame(const Vec3& approach, const Vec3& flexion) {
  Eigen::Matrix3d frame;
  frame << flexion.cross(approach), flexion, approach;
  return frame;
}

hands::ClosingRule rule_of(const PlaceParams& params) {
  hands::ClosingRule rule;
  if (params.closing_order == "proximal_first") rule.order = hands::ClosingOrder::proximal_first;
  if (params.closing_order == "together") rule.order = hands::ClosingOrder::together;
  if (params.closing_order == "breakaway") rule.order = hands::ClosingOrder::breakaway;
  return rule;
}

bool same_line(const PoseChoice& a, const PoseChoice& b) {
  return a.p_O == b.p_O && a.approach_O == b.approach_O && a.flexion_O == b.flexion_O &&
         a.roll_rad == b.roll_rad;
}

/// What a grasp tells about where it came from.
std::map<std::string, double> origin_of(const topology::Candidate& candidate, const PoseChoice& choice,
                                        bool gripper) {
  return {{"score", candidate.score},
          {"vertex", candidate.vertex},
          {"winding_angle_rad", candidate.winding_angle_rad},
          {"curvature_sum_rad", candidate.curvature_sum_rad},
          {"euler", candidate.euler},
          {gripper ? "straddle_m" : "gap_m", choice.gap_m},
          {"roll_rad", choice.roll_rad},
          {"spread_rad", choice.spread_rad}};
}

}  // namespace

PoseSearch::PoseSearch(const PlaceParams& params, const topology::Scores& scores,
                       const geometry::SignedDistanceField& field,
                       const std::optional<geometry::Plane>& support,
                       const geometry::SignedDistanceField& others, const hands::Hand& hand)
    : params_(params),
      scores_(scores),
      field_(field),
      support_(support),
      others_(others),
      hand_(hand),
      rule_(rule_of(params)),
      gripper_(gripper_of(hand)),
      center_of_mass_O_(geometry::mass_properties(scores.mesh).center) {
  for (const Vec3& p : scores.mesh.vertices)
    torque_length_m_ = std::max(torque_length_m_, (p - center_of_mass_O_).norm());
  if (params.measures && geometry::check_mesh(scores.mesh).euler < 2)
    for (topology::SurfaceLoop& loop : topology::handle_loops(scores.mesh))
      handles_O_.push_back(std::move(loop.path));
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
  const Eigen::Vector3i box(field.nodes[0] - 1, field.nodes[1] - 1, field.nodes[2] - 1);
  far_m_ += field.cell_m * box.cast<double>().norm();
}

std::vector<PlacedCapsule> PoseSearch::capsules(const Pose& X_OH, const Eigen::VectorXd& q) const {
  return hands::placed_capsules(hand_, X_OH, q);
}

double PoseSearch::com_offset_m(const PoseChoice& choice) const {
  return choice.approach_O.cross(center_of_mass_O_ - choice.p_O).norm();
}

/// The hand turned as the choice says, the middle of its palm's surface at a point.
Pose PoseSearch::palm_at(const Vec3& p_O, const PoseChoice& choice) const {
  const Vec3 flexion_O = Eigen::AngleAxisd(choice.roll_rad, choice.approach_O) * choice.flexion_O;
  Pose X_OH = Pose::Identity();
  X_OH.linear() = hand_frame(choice.approach_O, flexion_O) *
                  hand_frame(hand_.approach_H, hand_.flexion_axis_H).transpose();
  X_OH.translation() = p_O - X_OH.linear() * hand_.palm_H;
  return X_OH;
}

/// The hand on the line of the choice, its palm ahead, where palm or knuckles first touch.
std::optional<Pose> PoseSearch::first_contact(const PoseChoice& choice) const {
  Pose X_OH = palm_at(choice.p_O - far_m_ * choice.approach_O, choice);
  const auto all = capsules(X_OH, hand_.open_rad);
  std::vector<PlacedCapsule> base;
  for (int i : base_) base.push_back(all[i]);
  const auto travel_m = hands::free_travel_m(field_, base, choice.approach_O, far_m_ + palm_dent_m);
  if (!travel_m) return std::nullopt;
  X_OH.translation() += *travel_m * choice.approach_O;
  return X_OH;
}

/// The open posture, its first joints opened further, as far as that is allowed, until the whole hand is
/// free.
std::optional<Eigen::VectorXd> PoseSearch::free_preshape(const Pose& X_OH, const PoseChoice& choice) const {
  const auto& tree = hand_.tree;
  Eigen::VectorXd q = hand_.open_rad;
  if (!hand_.spread_dof.empty()) {
    const int d = tree.dof(hand_.spread_dof);
    q[d] = std::clamp(choice.spread_rad, tree.lower_rad[d], tree.upper_rad[d]);
  }
  std::set<int> first_dofs;  // jaws share one: it is opened once
  for (const hands::Finger& finger : hand_.fingers) first_dofs.insert(finger.dofs.front());
  const auto open = [&](double angle) {
    const Eigen::VectorXd before = q;
    for (int d : first_dofs)
      q[d] = std::clamp(q[d] - angle * hand_.closing_rad[d], tree.lower_rad[d], tree.upper_rad[d]);
    return q != before;
  };
  if (choice.opened_rad != 0) open(choice.opened_rad);
  for (double opened_rad = params_.opening_step_rad; !is_free(X_OH, q);
       opened_rad += params_.opening_step_rad)
    if (opened_rad > params_.max_opening_rad || !open(params_.opening_step_rad)) return std::nullopt;
  return q;
}

bool PoseSearch::is_free(const Pose& X_OH, const Eigen::VectorXd& q) const {
  const auto placed = capsules(X_OH, q);
  return std::all_of(placed.begin(), placed.end(), [&](const PlacedCapsule& capsule) {
    return hands::capsule_distance_bound_m(field_, capsule) >= params_.open_clearance_m ||
           hands::capsule_distance(field_, capsule).distance_m >= params_.open_clearance_m;
  });
}

/// The widest opening whose jaws are free on both sides of what is between them, the hand moved along their
/// line until both are equally far from it: one drive moves both, and stops when the first touches.
std::optional<Eigen::VectorXd> PoseSearch::straddle(Pose& X_OH) const {
  const auto& tree = hand_.tree;
  const int d = gripper_->dof;
  const double stroke_m = tree.upper_rad[d] - tree.lower_rad[d];
  Eigen::VectorXd q = hand_.open_rad;
  for (int i = 0; i < jaw_openings; ++i) {
    q[d] = hand_.open_rad[d] + hand_.closing_rad[d] * stroke_m * i / jaw_openings;
    if (q[d] < tree.lower_rad[d] || q[d] > tree.upper_rad[d]) break;
    if (!is_free(X_OH, q)) continue;
    const Pose X_centered = centered(*gripper_, hand_, field_, X_OH, capsules(X_OH, q));
    if (!is_free(X_centered, q)) continue;
    X_OH = X_centered;
    return q;
  }
  return std::nullopt;
}

/// Lowest point of the hand over the support in any of the postures; infinite without support.
double PoseSearch::lowest_m(const std::vector<Eigen::VectorXd>& postures, const Pose& X_OH) const {
  double lowest = std::numeric_limits<double>::infinity();
  if (!support_) return lowest;
  for (const Eigen::VectorXd& q : postures)
    for (const PlacedCapsule& capsule : capsules(X_OH, q))
      lowest = std::min({lowest, support_->height_m(capsule.a) - capsule.radius_m,
                         support_->height_m(capsule.b) - capsule.radius_m});
  return lowest;
}

bool PoseSearch::meets_obstacle(const std::vector<PlacedCapsule>& placed) const {
  return !others_.coarse.empty() && std::any_of(placed.begin(), placed.end(), [&](const auto& capsule) {
    return hands::capsule_distance(others_, capsule).distance_m < 0;
  });
}

/// Opens and closes the hand at X_OH, lifting it off the support where it comes too near.
std::string PoseSearch::close_above_support(Pose& X_OH, const PoseChoice& choice, Closing& closing) const {
  for (int attempt = 0; attempt < most_lifts; ++attempt) {
    const auto open = gripper_ ? straddle(X_OH) : free_preshape(X_OH, choice);
    if (!open) return "open hand collides";
    closing.open = *open;
    double missing_m = params_.support_clearance_m - lowest_m({*open}, X_OH);
    if (missing_m <= 0) {
      std::vector<Eigen::VectorXd> path;
      closing.hand = hands::close_hand(hand_, field_, X_OH, *open, rule_, support_ ? &path : nullptr);
      missing_m = params_.support_clearance_m - lowest_m(path, X_OH);
    }
    if (missing_m <= 0) return {};
    closing.lift_m += missing_m + lift_slack_m;
    if (closing.lift_m > params_.max_lift_m) break;
    X_OH.translation() += (missing_m + lift_slack_m) * support_->normal;
  }
  return "too near the support";
}

std::string PoseSearch::try_pose(Pose X_OH, const PoseChoice& choice, hands::Grasp& grasp) const {
  Closing closing;
  std::string rule = close_above_support(X_OH, choice, closing);
  if (!rule.empty()) return rule;
  const Vec3 reach_from(params_.reach_from_m[0], params_.reach_from_m[1], params_.reach_from_m[2]);
  if (params_.max_reach_m > 0 && (X_OH.translation() - reach_from).norm() > params_.max_reach_m)
    return "out of reach";
  const hands::ClosedHand& closed = closing.hand;
  const int needed = std::min(params_.min_fingers, static_cast<int>(hand_.fingers.size()));
  if (closed.fingers_touching < needed) return "too few fingers touch";
  if (closed.penetration_m > params_.max_penetration_m) return "penetrates";
  const auto placed = capsules(X_OH, closed.q);
  if (meets_obstacle(placed) || meets_obstacle(capsules(X_OH, closing.open)))
    return "meets known occupied space";
  const double blocked = hands::blocked_share(field_, placed, params_.escape_m);
  const double opposed =
      gripper_ ? opposition(*gripper_, hand_, X_OH, closed.contacts) : 0;  // two pads hold, they can't cage
  if (gripper_ && opposed < std::cos(std::atan(params_.friction_mu))) return "pads don't face each other";
  if (!gripper_ && blocked < params_.min_blocked_share) return "leaves a way out";
  grasp.hand = hand_.name;
  grasp.object = params_.object;
  grasp.X_OH = hands::file_pose(X_OH);
  grasp.joints_rad = hands::joint_map(hand_.tree, closed.q);
  grasp.pregrasp_joints_rad = hands::joint_map(hand_.tree, closing.open);
  rate(closed, blocked, grasp);
  if (gripper_) {
    grasp.scores["opposition"] = opposed;
    if (params_.rank_by == "cage") grasp.scores["rank"] += opposed;
  }
  grasp.scores["lift_m"] = closing.lift_m;
  return {};
}

void PoseSearch::rate(const hands::ClosedHand& closed, double blocked, hands::Grasp& grasp) const {
  const double margin = hands::closure_margin(closed.contacts);
  double rank = blocked + params_.margin_weight * margin;
  if (params_.rank_by == "flux") rank = flux(grasp.X_OH, closed.q);
  grasp.scores = {{"rank", rank},
                  {"blocked_share", blocked},
                  {"closure_margin", margin},
                  {"fingers", closed.fingers_touching},
                  {"contacts", static_cast<double>(closed.contacts.size())},
                  {"penetration_m", closed.penetration_m}};
}

/// Share of the object's field lines that the hand's sheet catches.
double PoseSearch::flux(const Pose& X_OH, const Eigen::VectorXd& q) const {
  const auto lines = hands::finger_lines(hand_, X_OH, q);
  const auto sheet = hands::hand_sheet(lines, X_OH * hand_.palm_H, X_OH.linear() * hand_.approach_H);
  return std::abs(topology::flux_share(scores_.mesh, sheet));
}

/// The rule that turns the choice down, or empty and the grasp in `grasp`. `contact` is where the palm first
/// touches. A gripper's pads come as far behind the surface as the choice says, wherever its palm is.
std::string PoseSearch::try_choice(const PoseChoice& choice, const std::optional<Pose>& contact,
                                   hands::Grasp& grasp) const {
  if (gripper_)
    return try_pose(palm_at(choice.p_O + (choice.gap_m - gripper_->reach_m) * choice.approach_O, choice),
                    choice, grasp);
  if (!contact) return "palm meets nothing";
  Pose X_OH = *contact;
  X_OH.translation() -= choice.gap_m * choice.approach_O;
  return try_pose(X_OH, choice, grasp);
}

CandidatePoses PoseSearch::search(const topology::Candidate& candidate) const {
  CandidatePoses poses;
  PoseList list = listed_poses(params_, candidate, scores_.mesh, gaps_m());
  const auto samples = local_poses(params_, list, candidate, gaps_m());
  list.choices.insert(list.choices.end(), samples.begin(), samples.end());
  poses.tried = static_cast<int>(list.choices.size()) + list.no_direction;
  if (list.no_direction > 0) poses.rejected["no direction to the ball's centre"] = list.no_direction;
  const auto& observed = scores_.mesh.observed;
  const bool unseen = !observed.empty() && observed[candidate.vertex] < params_.min_observed;
  const PoseChoice* before = nullptr;
  std::optional<Pose> contact;
  for (const PoseChoice& choice : list.choices) {
    const double offset_m = com_offset_m(choice);
    hands::Grasp grasp;
    std::string rule = unseen ? "never observed" : "far from the centre of mass";
    if (!unseen && offset_m <= params_.max_com_offset_m) {
      if (!gripper_ && (!before || !same_line(*before, choice))) contact = first_contact(choice);
      before = &choice;
      rule = try_choice(choice, contact, grasp);
    }
    if (!rule.empty()) {
      ++poses.rejected[rule];
      continue;
    }
    grasp.heuristic = candidate.heuristic;
    grasp.scores.merge(origin_of(candidate, choice, gripper_.has_value()));
    grasp.scores["ball_radius_m"] = scores_.ball.radius_m;
    grasp.scores["com_offset_m"] = offset_m;
    poses.grasps.push_back(std::move(grasp));
  }
  return poses;
}

void PoseSearch::measure(hands::Grasp& grasp, const topology::Candidate& candidate) const {
  const Eigen::VectorXd q = hands::joint_vector(hand_.tree, grasp.joints_rad, "a grasp");
  const auto placed = capsules(grasp.X_OH, q);
  const auto contacts = hands::contacts_of(hand_, field_, placed, rule_.contact_m);
  const auto lines = hands::finger_lines(hand_, grasp.X_OH, q);
  const Vec3 axis =
      candidate.axis_O.norm() > 0.5 ? candidate.axis_O : Vec3(grasp.X_OH.linear() * hand_.flexion_axis_H);
  const auto wraps = hands::wrap_angles_rad(lines, candidate.center_O, axis);
  for (std::size_t i = 0; i < wraps.size(); ++i) grasp.scores["wrap_rad." + hand_.fingers[i].name] = wraps[i];
  grasp.scores["contact_wrap_rad"] = hands::contact_wrap_rad(contacts, candidate.center_O, axis);
  grasp.scores["enclosed_share"] = hands::enclosed_share(placed, candidate.center_O);
  const auto loops = hands::hand_loops(lines, grasp.X_OH * hand_.palm_H);
  grasp.scores["handle_linking"] = hands::handle_linking(loops, handles_O_);
  grasp.scores["axis_linking"] = hands::axis_linking(loops, candidate.center_O, axis);
  grasp.scores["flux_share"] = flux(grasp.X_OH, q);
  const hands::FrictionModel model{params_.friction_mu, params_.friction_edges, center_of_mass_O_,
                                   torque_length_m_, hand_.torsion_m};
  const auto closure = hands::force_closure(contacts, model);
  grasp.force_closure = hands::name_of(closure.outcome);
  grasp.scores["ferrari_canny_low"] = closure.low;
  grasp.scores["ferrari_canny_high"] = closure.high;
  grasp.scores["wrench_volume"] = closure.volume;
  grasp.scores["friction_mu"] = params_.friction_mu;
  grasp.scores["torque_length_m"] = torque_length_m_;
}

}  // namespace geocage::stages
