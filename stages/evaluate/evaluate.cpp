#include "stages/evaluate/evaluate.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numbers>
#include <optional>
#include <span>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "hands/closing.h"
#include "pipeline/error.h"
#include "stages/evaluate/force_protocol.h"

namespace geocage::stages {
namespace {

using geometry::Pose;
using geometry::Vec3;
using pipeline::Fault;
using pipeline::UserError;

constexpr double null_distance_m = 1;

double degrees(double rad) {
  return rad * 180 / std::numbers::pi;
}

std::string where(std::size_t grasp) {
  return fmt::format("grasp {}", grasp);
}

void check_pose(const Pose& X_OH, const std::string& element) {
  const Eigen::Matrix3d R = X_OH.linear();
  const double skew = (R.transpose() * R - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  if (X_OH.matrix().allFinite() && skew < 1e-6 && R.determinant() > 0) return;
  throw UserError(Fault::input, element + ": X_OH", "the pose is not a finite rigid motion",
                  "give p_m in metres and a unit quaternion q_wxyz");
}

/// Capsules thicker than the field's border would meet its estimates instead of its distances.
void check_border(const geometry::TriangleMesh& object, const geometry::SignedDistanceField& field,
                  const hands::Hand& hand) {
  Eigen::AlignedBox3d surface;
  for (const Vec3& vertex : object.vertices) surface.extend(vertex);
  const Vec3 end =
      field.origin + field.cell_m * Vec3(field.nodes[0] - 1, field.nodes[1] - 1, field.nodes[2] - 1);
  const double border = std::min((surface.min() - field.origin).minCoeff(), (end - surface.max()).minCoeff());
  double thickest = 0;
  for (const hands::Capsule& capsule : hand.capsules) thickest = std::max(thickest, capsule.radius_m);
  if (border >= thickest) return;
  throw UserError(
      Fault::configuration, "field.pad_m",
      fmt::format("the field ends {:.1f} mm from the object, but '{}' has capsules of {:.1f} mm radius",
                  1e3 * border, hand.name, 1e3 * thickest),
      fmt::format("raise it to {:.3f} or more", thickest + 1e-3));
}

/// Deepest capsule of the posture inside the object.
double penetration_m(const hands::Hand& hand, const geometry::SignedDistanceField& field,
                     const Posture& posture) {
  std::vector<Pose> X_HL;
  std::vector<hands::PlacedCapsule> placed;
  hands::forward_kinematics(hand.tree, posture.q, X_HL);
  hands::place_capsules(hand, posture.X_OH, X_HL, placed);
  double deepest = 0;
  for (const hands::PlacedCapsule& capsule : placed)
    deepest = std::max(deepest, -hands::capsule_distance(field, capsule).distance_m);
  return deepest;
}

std::vector<Posture> postures_of(const hands::GraspSet& set, const hands::Hand& hand,
                                 const geometry::SignedDistanceField& field, const Grip& grip) {
  std::vector<Posture> postures;
  for (std::size_t i = 0; i < set.grasps.size(); ++i) {
    const hands::Grasp& grasp = set.grasps[i];
    if (grasp.hand != hand.name)
      throw UserError(Fault::input, where(i),
                      fmt::format("is for the hand '{}', not '{}'", grasp.hand, hand.name),
                      "name the hand that the grasp was made for");
    check_pose(grasp.X_OH, where(i));
    Posture posture{grasp.X_OH, hands::joint_vector(hand.tree, grasp.joints_rad, where(i)), {}, 0};
    posture.q_target = squeezed(hand, posture.q, grip);
    posture.penetration_m = penetration_m(hand, field, posture);
    postures.push_back(std::move(posture));
  }
  return postures;
}

std::optional<std::string> rejection(const Posture& posture, const motion::Trajectory* approach,
                                     const Protocol& protocol) {
  if (approach && approach->outcome != "planned") return "no approach path: " + approach->outcome;
  if (posture.penetration_m > protocol.max_penetration_m)
    return fmt::format("the hand starts {:.1f} mm inside the object (limit {:.0f} mm)",
                       1e3 * posture.penetration_m, 1e3 * protocol.max_penetration_m);
  return {};
}

/// An entry for each grasp; those that need no simulation have their verdict.
std::vector<Evaluation> screened(const std::vector<Posture>& postures,
                                 const std::vector<motion::Trajectory>& approaches,
                                 const Protocol& protocol) {
  if (!approaches.empty() && approaches.size() != postures.size())
    throw UserError(Fault::input, "trajectories",
                    fmt::format("there are {} for {} grasps", approaches.size(), postures.size()),
                    "plan one approach a grasp, or give none");
  std::vector<Evaluation> list(postures.size());
  for (std::size_t i = 0; i < postures.size(); ++i) {
    list[i].grasp = static_cast<int>(i);
    list[i].start_penetration_m = postures[i].penetration_m;
    if (const auto why = rejection(postures[i], approaches.empty() ? nullptr : &approaches[i], protocol))
      list[i].outcome = Outcome::rejected, list[i].reason = *why;
  }
  return list;
}

/// The hand backed away from the object, against its approach.
Posture far_away(const hands::Hand& hand, Posture posture) {
  posture.X_OH.translate(-null_distance_m * hand.approach_H);
  return posture;
}

/// All directions of each posture, in order; one world a trial, so threads share nothing.
std::vector<PushTrial> push_all(const Protocol& protocol, const ObjectBody& object, const hands::Hand& hand,
                                const std::vector<Posture>& postures, std::uint64_t seed,
                                pipeline::Run& run) {
  const auto& directions = six_directions();
  std::vector<PushTrial> trials(postures.size() * directions.size());
  std::size_t done = 0;
#pragma omp parallel for schedule(dynamic, 1)
  for (std::size_t i = 0; i < trials.size(); ++i) {
    const Posture& posture = postures[i / directions.size()];
    trials[i] = push_trial(protocol, object, hand, posture, directions[i % directions.size()].axis_O, seed);
#pragma omp critical
    run.progress(++done, trials.size());
  }
  return trials;
}

/// The worst of its pushes decides a grasp.
Outcome worst(std::span<const PushTrial> trials) {
  for (const Outcome outcome : {Outcome::error, Outcome::unsettled, Outcome::lost})
    if (std::ranges::find(trials, outcome, &PushTrial::outcome) != trials.end()) return outcome;
  return Outcome::held;
}

std::string lost_reason(const std::vector<DirectionResult>& pushes, const Protocol& protocol) {
  std::vector<std::string> losses;
  for (const DirectionResult& push : pushes)
    if (push.outcome == Outcome::lost)
      losses.push_back(fmt::format("{} after {:.2f} s", push.name, push.ended_s));
  return fmt::format("moved by {:.0f} cm or {:.0f} deg when pushed along {}",
                     1e2 * protocol.max_translation_m, degrees(protocol.max_rotation_rad),
                     fmt::join(losses, ", "));
}

std::string reason(const Evaluation& evaluation, const Protocol& protocol) {
  switch (evaluation.outcome) {
    case Outcome::error:
      return fmt::format("the simulation failed: NaN, more than {:.0f} m/s, or {:.1f} mm inside",
                         protocol.max_speed_m_s, 1e3 * evaluation.max_penetration_m);
    case Outcome::unsettled:
      return fmt::format(
          "the closing hand moved the object by {:.1f} mm and {:.1f} deg (limits {:.0f} mm, {:.0f} deg)",
          1e3 * evaluation.drift_m, degrees(evaluation.drift_rad), 1e3 * protocol.max_drift_m,
          degrees(protocol.max_drift_rad));
    case Outcome::lost:
      return lost_reason(evaluation.directions, protocol);
    default:
      return fmt::format("held against {} pushes", evaluation.directions.size());
  }
}

void judge(Evaluation& evaluation, std::span<const PushTrial> trials, const Protocol& protocol) {
  for (std::size_t d = 0; d < trials.size(); ++d) {
    const PushTrial& trial = trials[d];
    evaluation.drift_m = std::max(evaluation.drift_m, trial.drift_m);
    evaluation.drift_rad = std::max(evaluation.drift_rad, trial.drift_rad);
    evaluation.max_penetration_m = std::max(evaluation.max_penetration_m, trial.penetration_m);
    evaluation.directions.push_back(
        {six_directions()[d].name, trial.outcome, trial.displacement_m, trial.rotation_rad, trial.ended_s});
  }
  evaluation.outcome = worst(trials);
  evaluation.reason = reason(evaluation, protocol);
}

void report(const Evaluations& all, const std::vector<PushTrial>& trials, pipeline::Run& run) {
  double steps = 0;
  for (const PushTrial& trial : trials) steps += trial.steps;
  for (const Outcome outcome : outcomes) run.metric(std::string(name(outcome)), all.count(outcome));
  run.metric("null_trials", all.null_control.trials);
  run.metric("null_held", all.null_control.held);
  run.metric("simulated_steps", steps);
  if (!all.valid())
    run.log("the null control held an object with the hand 1 m away: this run proves nothing");
}

}  // namespace

void EvaluateParams::visit(pipeline::Fields& f) {
  f("protocol", protocol, protocol_names(), "named test: loads, friction, limits and engine settings");
  f("friction", friction, {0, 10}, "Coulomb's mu of every contact");
  f("object_geometry", object_geometry, {"truth", "reconstruction", "given"},
    "which geometry of the object is simulated; kept with the results");
  f("null_grasps", null_grasps, {1, 1e6}, "grasps repeated with the hand 1 m away, where nothing may hold");
  f("seed", seed, "seed of the solver");
}

std::string_view name(Outcome outcome) {
  switch (outcome) {
    case Outcome::held:
      return "held";
    case Outcome::lost:
      return "lost";
    case Outcome::rejected:
      return "rejected";
    case Outcome::unsettled:
      return "unsettled";
    case Outcome::error:
      return "error";
  }
  std::abort();
}

int Evaluations::count(Outcome outcome) const {
  return static_cast<int>(std::ranges::count(list, outcome, &Evaluation::outcome));
}

Evaluations evaluate(const EvaluateParams& params, pipeline::Run& run, const hands::GraspSet& grasps,
                     const motion::TrajectorySet& trajectories, const geometry::TriangleMesh& object,
                     const geometry::SignedDistanceField& field, const hands::Hand& hand) {
  Protocol protocol = find_protocol(params.protocol);
  protocol.engine.friction = params.friction;
  check_border(object, field, hand);
  const ObjectBody body = solid_body(object, field, protocol.mass_kg);
  const std::vector<Posture> postures = postures_of(grasps, hand, field, protocol.grip);

  Evaluations all{params, screened(postures, trajectories.trajectories, protocol), {}};
  std::vector<Posture> tested;
  for (const Evaluation& evaluation : all.list)
    if (evaluation.outcome != Outcome::rejected) tested.push_back(postures[evaluation.grasp]);
  const std::size_t controls = hand.net ? 0 : std::min<std::size_t>(postures.size(), params.null_grasps);
  for (std::size_t i = 0; i < controls; ++i) tested.push_back(far_away(hand, postures[i]));

  const std::vector<PushTrial> trials = push_all(protocol, body, hand, tested, params.seed, run);
  std::span<const PushTrial> rest(trials);
  for (Evaluation& evaluation : all.list) {
    if (evaluation.outcome == Outcome::rejected) continue;
    judge(evaluation, rest.first(six_directions().size()), protocol);
    rest = rest.subspan(six_directions().size());
  }
  all.null_control.trials = static_cast<int>(rest.size());
  all.null_control.held = static_cast<int>(std::ranges::count(rest, Outcome::held, &PushTrial::outcome));
  report(all, trials, run);
  return all;
}

}  // namespace geocage::stages
