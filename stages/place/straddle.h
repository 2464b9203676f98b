#pragma once
#include "geometry/distance_field.h"
#include "hands/hand.h"

namespace geocage::stages {

/// Whether the hand is a gripper: two fingers on one joint. Its jaws close alike wherever the object is, so
/// that both touch only what is in the middle between them.
bool is_gripper(const hands::Hand& hand);

/// How far the gripper at X_OH, its jaws as in `q`, must be moved along their line for both to be as far from
/// the object's section there: the middle of the stroke comes to the middle of the section, to 0.5 mm. Jaws
/// that are free are closed where they are (one may stand in a mug); jaws that are not come from outside.
/// Zero when a jaw would meet nothing. Precondition: `is_gripper(hand)`. O(way / 1 mm) looks at the field.
geometry::Vec3 centring_m(const hands::Hand& hand, const geometry::SignedDistanceField& field,
                          const geometry::Pose& X_OH, const Eigen::VectorXd& q);

}  // namespace geocage::stages
