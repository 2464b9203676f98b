#pragma once
#include "physics/world.h"

#include "hands/grasp.h"
#include "hands/hand.h"

namespace geocage::bench {

/// What a locked hand without friction keeps of six pulls along the axes of O, and of the four of a ring.
struct Kept {
  int pulls = 0, ring = 0;
};
/// `radius_m`: of the object about its centre of mass. The cage stage's trials (physics/cage_trial.h).
Kept kept_by(const hands::Hand& hand, const hands::Grasp& grasp, const physics::ObjectBody& body,
             double radius_m);

}  // namespace geocage::bench
