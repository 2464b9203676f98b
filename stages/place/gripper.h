#pragma once
#include <optional>
#include <vector>

#include "geometry/distance_field.h"
#include "hands/closing.h"

namespace geocage::stages {

/// Two fingers that one sliding drive moves towards each other.
struct Gripper {
  int dof = 0;
  geometry::Vec3 closing_H =
      geometry::Vec3::Zero();  ///< unit: the way the first finger closes, the second the opposite
  double reach_m = 0;          ///< of the fingers, beyond the palm's surface
  double opening_m = 0;        ///< between the open fingers
};

/// Nothing for a hand of any other kind.
std::optional<Gripper> gripper_of(const hands::Hand& hand);

/// The hand moved along the jaws' line until both are equally far from the object, so that they touch at
/// once. Moving along the line does not change where the jaws touch, so one move is enough, to 0.02 mm.
/// `X_OH` itself when a jaw meets nothing. Precondition: `placed` is the hand at `X_OH`, free. O(capsules x
/// steps).
geometry::Pose centered(const Gripper& gripper, const hands::Hand& hand,
                        const geometry::SignedDistanceField& field, const geometry::Pose& X_OH,
                        const std::vector<hands::PlacedCapsule>& placed);

/// Cosine of the angle between the jaws' line and the normal at the worse of both jaws: at least
/// cos(atan mu) when two soft-finger contacts that face each other close by force (Nguyen, Int. J. Robotics
/// Research 1988, section 4). -1 when a jaw has no contact.
double opposition(const Gripper& gripper, const hands::Hand& hand, const geometry::Pose& X_OH,
                  const std::vector<hands::Contact>& contacts);

}  // namespace geocage::stages
