#pragma once
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "physics/force_trial.h"
#include <nlohmann/json_fwd.hpp>

#include "hands/grasp.h"

namespace geocage::physics {

/// How far a load can be raised before a grasp fails, between an easy and a hard level.
struct Margin {
  double easy = 0, hard = 0;
  std::optional<double> level;  ///< the hardest that held; nothing when the easy one did not
};

/// {"level": number or null, "easy": e, "hard": h}.
nlohmann::json to_json(const Margin& margin);
Margin margin_from(const nlohmann::json& entry);

/// Bisects `halvings` times between the levels; that whatever holds at one level holds at all easier ones is
/// taken for granted. O(halvings) calls.
Margin hardest(double easy, double hard, int halvings, const std::function<bool(double)>& holds);

/// A displacement of the hand about its palm, even over the box +-1 and over turns of +-1 about an even axis.
struct PoseDraw {
  geometry::Vec3 shift = geometry::Vec3::Zero(), axis = geometry::Vec3::UnitX();
  double turn = 0;
};
/// The same draws for the same seed: levels are compared on the same ones (paired).
std::vector<PoseDraw> pose_draws(int count, std::uint64_t seed);
/// X_OH displaced by `shift_m` and `turn_rad` times the draw.
geometry::Pose displaced(const hands::Hand& hand, const geometry::Pose& X_OH, const PoseDraw& draw,
                         double shift_m, double turn_rad);

struct MarginRule {
  int draws = 20, halvings = 5;
  double share = 0.95;                                     ///< of the draws that must hold
  double noise_m = 0.005, noise_rad = 0.0872664625997165;  ///< 5 mm, 5 deg (get_a_grip)
  double small_share = 0.2;                                ///< of that noise, while another load is raised
};

/// In how many of the rule's draws, displaced by `noise` times its noise, the hand closed anew holds all six
/// pushes; 0 once more than `most_failures` have failed. Same answer for any number of threads. O(draws * 6
/// pushes).
int draws_held(const Protocol& protocol, const ObjectBody& object, const hands::Hand& hand,
               const geometry::Pose& X_OH, const Eigen::VectorXd& q_open, const MarginRule& rule,
               double noise, std::uint64_t seed, int most_failures);

/// A grasp's margins in the force test. A draw holds when the hand, displaced and closed anew, holds all six
/// pushes.
struct ForceMargins {
  int draws = 0, held = 0;  ///< under the whole noise: P(success) = held / draws
  Margin friction;          ///< smallest Coulomb's mu, from 1 down, or where that fails from the protocol's
  Margin push_m_s2;         ///< largest push per mass, up to 100
  Margin noise;             ///< largest share of the noise, up to 2
};
/// `q_open`: where the hand closes from. Same answer for any number of threads. O(halvings * draws * 6
/// pushes).
ForceMargins force_margins(const Protocol& protocol, const ObjectBody& object, const hands::Hand& hand,
                           const geometry::Pose& X_OH, const Eigen::VectorXd& q_open, const MarginRule& rule,
                           std::uint64_t seed);

nlohmann::json to_json(const ForceMargins& margins);
ForceMargins force_margins_from(const nlohmann::json& entry);

/// How far one finger may open.
struct Loosening {
  std::string finger;
  Margin share;  ///< of the way from the closed to the open posture
};
/// Fingers one by one opened from `q` towards `q_open`, locked there, and every pull and ring way that held
/// when closed pulled again: the largest opening at which all of them still hold. Nothing for a hand that
/// held none. Adds the trials it makes to `trials`. O(fingers * halvings * pulls).
std::vector<Loosening> loosening(const CageProtocol& protocol, const ObjectBody& object, double radius_m,
                                 const hands::Hand& hand, const geometry::Pose& X_OH,
                                 const Eigen::VectorXd& q, const Eigen::VectorXd& q_open, int halvings,
                                 std::uint64_t seed, int* trials = nullptr);

}  // namespace geocage::physics
