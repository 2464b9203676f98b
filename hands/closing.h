#pragma once
#include <optional>
#include <vector>

#include "geometry/distance_field.h"
#include "hands/hand.h"

namespace geocage::hands {

/// Signed distance of a capsule's surface to the object: the smallest of the field along its axis minus the
/// radius, from samples at least every `step_m` where the field is near, refined by golden section. `p_O` is
/// the axis point, `n_O` the field's unit gradient there.
struct CapsuleDistance {
  double distance_m;
  Vec3 p_O, n_O;
};
CapsuleDistance capsule_distance(const geometry::SignedDistanceField& field, const PlacedCapsule& capsule_O,
                                 double step_m = 0.004);

/// A lower bound of that distance from one look at the field, at the capsule's middle.
double capsule_distance_bound_m(const geometry::SignedDistanceField& field, const PlacedCapsule& capsule_O);

/// Distance between the surfaces of two capsules, negative when they overlap. Exact.
double capsule_gap_m(const PlacedCapsule& a, const PlacedCapsule& b);

struct Contact {
  int link = 0;
  Vec3 p_O = Vec3::Zero();   ///< on the object's surface
  Vec3 n_O = Vec3::UnitZ();  ///< outward from the object
  double distance_m = 0;
};

/// The nearest point of each link whose distance to the object is at most `contact_m`, by link.
std::vector<Contact> contacts_of(const Hand& hand, const geometry::SignedDistanceField& field,
                                 const std::vector<PlacedCapsule>& capsules_O, double contact_m);

enum class Closure { closed, blocked_at_start };

struct ClosedHand {
  Closure outcome = Closure::closed;
  Eigen::VectorXd q;
  std::vector<Contact> contacts;  ///< the nearest point of each link within `contact_m`, by link
  double penetration_m = 0;       ///< deepest of all capsules, 0 when free
  int fingers_touching = 0;
};

struct ClosingRule {
  double step_rad = 0.05;             ///< at most: fingers take turns that often
  double contact_m = 0.0025;          ///< links nearer than this are contacts
  std::optional<ClosingOrder> order;  ///< the hand's own when there is none
};

/// Closes the hand until each joint has a reason to stop: a link that it moves touches the object (to 0.2 mm)
/// or another part of the hand, or the joint ends. A step is at most what the links are known to be free,
/// over their lever: nothing tunnels. Neighbouring links, and links that overlap in `q_open`, may touch.
/// `blocked_at_start` when a capsule of the open hand is inside the object: q is then `q_open`,
/// `penetration_m` says how deep. Every posture on the way is added to `path`. Precondition: `q_open` within
/// the limits.
ClosedHand close_hand(const Hand& hand, const geometry::SignedDistanceField& field, const Pose& X_OH,
                      const Eigen::VectorXd& q_open, const ClosingRule& rule,
                      std::vector<Eigen::VectorXd>* path = nullptr);

}  // namespace geocage::hands
