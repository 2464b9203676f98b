#pragma once
#include <string>
#include <vector>

#include "physics/protocols.h"

#include "geometry/distance_field.h"
#include "hands/grasp.h"
#include "hands/hand.h"

namespace geocage::physics {

/// A hand to test: where it is and what its joints are.
struct Posture {
  geometry::Pose X_OH = geometry::Pose::Identity();
  Eigen::VectorXd q;
  double penetration_m = 0;  ///< deepest capsule inside the object
};

Posture posture_at(const hands::Hand& hand, const geometry::SignedDistanceField& field,
                   const geometry::Pose& X_OH, const Eigen::VectorXd& q);

/// The closed posture of each grasp. Errors (UserError, input): a pose that is no finite rigid motion, a
/// joint that is unknown, missing or out of limits, a grasp of another hand.
std::vector<Posture> postures_of(const hands::GraspSet& set, const hands::Hand& hand,
                                 const geometry::SignedDistanceField& field);

/// The same with the fingers as they were before closing. A grasp without a pre-grasp uses the hand's own
/// open posture.
Posture open_posture(const hands::Hand& hand, const geometry::SignedDistanceField& field,
                     const hands::Grasp& grasp);
/// The hand backed away from the object, 1 m against its approach.
Posture far_posture(const hands::Hand& hand, const Posture& posture);
/// Joints even between their limits, the palm where it was. Same seed and index, same joints.
Posture random_posture(const hands::Hand& hand, const geometry::SignedDistanceField& field,
                       const Posture& posture, std::uint64_t seed, std::size_t index);

/// UserError (configuration) when the field's border is thinner than the hand's thickest capsule, which would
/// meet its estimates instead of its distances.
void check_border(const geometry::TriangleMesh& object, const geometry::SignedDistanceField& field,
                  const hands::Hand& hand);

}  // namespace geocage::physics
