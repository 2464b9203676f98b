#pragma once
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "motion/certificate.h"
#include "motion/gauss_newton.h"
#include "motion/rrt_connect.h"
#include "motion/shortcuts.h"

namespace geocage::motion {

struct ApproachRule {
  int steps = 32;           ///< of the free part
  int closing_steps = 20;   ///< of closing, at least
  double retreat_m = 0.12;  ///< from here on a scripted way is straight along the approach
  double margin_m = 0.012;  ///< the path is pushed off surfaces nearer than this; fades over the last quarter
  double self_margin_m = 0.004;  ///< and links off each other
  double collision_precision = 0.5;
  double goal_precision = 1e4;
  double limits_precision = 10;
  double winding_precision = 0;  ///< weight of fingers that wrap as they come (wrapping_tasks); 0: none
  double damping = 0.1;
  double cost_tolerance = 1e-2;  ///< a search ends when a sweep brings less than this share
  int max_sweeps = 40;
  bool by_messages = false;            ///< AICO instead of block Gauss-Newton: the same cost
  double tolerance_m = 5e-4;           ///< an open hand is nowhere deeper than this
  double closing_tolerance_m = 0.003;  ///< fingers that close may be
  double wrap_clearance_m = 0.002;     ///< fingers close on the way as far as they are proven to keep this
  double cut_clearance_m = 0.001;  ///< a straight piece replaces waypoints where it is proven to keep this
  int rrt_iterations = 2000;
  std::uint64_t seed = 1;
};

/// From where to where: all in the mover's states.
struct ApproachGoal {
  Eigen::VectorXd start;  ///< far, hand open
  Path closing;           ///< from the open hand at the grasp to the closed one, every posture of close_hand
  Vec3 approach_O = Vec3::UnitZ();  ///< the way that the hand comes along, at the grasp
};

enum class ApproachOutcome {
  planned,
  closing_collides,  ///< palm or other links get deeper than the tolerance while fingers close
  goal_blocked,      ///< the open hand at the grasp is not free
  start_blocked,
  no_way,  ///< neither script nor RRT-Connect found a way that is proven
};
std::string_view name_of(ApproachOutcome outcome);

struct ApproachPlan {
  ApproachOutcome outcome = ApproachOutcome::no_way;
  Path path;  ///< start to closed hand; empty unless planned
  std::size_t free =
      0;  ///< waypoints before this are proven to `tolerance_m`; what follows replays close_hand
  std::string
      planner;       ///< whose way: "gauss_newton" or "aico" improved it; "script", "rrt_connect" as they are
  std::string seed;  ///< where it was improved from: "script" or "rrt_connect"
  std::string closing;   ///< "straight" from a posture a little more open, or "replayed" as close_hand closed
  Certificate proof;     ///< of the free part
  double deepest_m = 0;  ///< of the best that was refused, when nothing is planned
  double cost = 0;       ///< of the improved free part
  int sweeps = 0;        ///< of all improvements tried
  double seed_length = 0, length = 0;  ///< in units of the state
};

/// Ways of one body among one set of obstacles. A search shortens and smooths a scripted way whose fingers
/// close as they go, to a posture that is the closed one opened until it keeps `wrap_clearance_m`; from there
/// they close straight. Where that is not proven, reliability first: a way of the open hand, scripted or by
/// RRT-Connect, with close_hand's own closing, is proven as a seed, the search starts from it, and what is
/// proven and shortest is the answer. Everything that is returned is proven free (Prover), and says whose it
/// is. Mover and fields must outlive it.
class ApproachPlanner {
 public:
  ApproachPlanner(const Mover& mover, const Obstacles& obstacles, std::vector<std::pair<int, int>> self_pairs,
                  const ApproachRule& rule);
  /// Without `sampling` scripted ways only.
  ApproachPlan plan(const ApproachGoal& goal, bool sampling = true);

  // The parts, for those who measure them.
  /// Closing thinned out to about `closing_steps` if that is proven, else every posture; empty when neither
  /// is.
  Path proven_closing(const ApproachGoal& goal);
  std::optional<Path> scripted(const ApproachGoal& goal);
  std::optional<Path> connected(const ApproachGoal& goal, double room_m);
  /// Least cost from `seed`, whose ends stay exactly, with this share of the margins. Not proven.
  Path improved(const Path& seed, double collision_precision, ApproachPlan& report, double margin_share = 1,
                int most_sweeps = std::numeric_limits<int>::max());
  Certificate prove_free(const Path& path) { return prover_.certify(path, free_tolerance_); }
  Certificate prove_closing(const Path& path) { return prover_.certify(path, closing_tolerance_); }
  Prover& prover() { return prover_; }
  const std::vector<double>& closing_tolerance_m() const { return closing_tolerance_; }
  /// Bounds of the states that RRT-Connect samples for this goal.
  void box(const ApproachGoal& goal, Eigen::VectorXd& lower, Eigen::VectorXd& upper) const;
  /// Extra tasks for improvement, T + 1 precisions each (`steps`).
  std::vector<Task> extra_tasks;

 private:
  /// The closed posture opened until it keeps the clearance, and the closed one, if straight closing is
  /// proven; else empty.
  Path straight_closing(const ApproachGoal& goal);
  /// Whether a search from `way` to where `rest` begins is proven; then it is `plan`, if that is none or
  /// longer.
  bool improve(const Path& way, const Path& rest, const char* closing, ApproachPlan& plan);
  Path way_of(const ApproachGoal& goal) const;
  ApproachPlan found(const ApproachGoal& goal, bool sampling);
  /// Where shorter pieces are proven (Shortcuts).
  void shorten(ApproachPlan& plan);
  bool within_limits(const Path& path) const;

  const Mover& mover_;
  const Obstacles obstacles_;
  const std::vector<std::pair<int, int>> pairs_;
  const ApproachRule rule_;
  Prover prover_;
  std::vector<double> free_tolerance_, closing_tolerance_, cut_tolerance_;  ///< of each link
};

}  // namespace geocage::motion
