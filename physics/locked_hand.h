#pragma once
#include "physics/escape_test.h"
#include "physics/protocols.h"
#include "physics/world.h"

#include "hands/hand.h"

namespace geocage::physics {

/// A hand whose fingers are locked where they closed, ready for the cage test.
struct LockedHand {
  CageProtocol protocol;  ///< fails a trial whose contacts get deeper than half of the thinnest finger
  EscapeTest escape;      ///< the capsules, backed off from the object
  geometry::Vec3 axis_O;  ///< the hand's flexion axis: of the ring test
  double backed_off_m;    ///< back_off.h
};

/// `radius_m`: of the object about its centre of mass.
LockedHand lock(const CageProtocol& protocol, const ObjectBody& object, double radius_m,
                const hands::Hand& hand, const geometry::Pose& X_OH, const Eigen::VectorXd& q);

}  // namespace geocage::physics
