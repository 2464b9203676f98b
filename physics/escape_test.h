#pragma once
#include <optional>
#include <vector>

#include "physics/world.h"

#include "hands/caging.h"

namespace geocage::physics {

/// Points within `radius_m` of `center`.
struct Ball {
  geometry::Vec3 center = geometry::Vec3::Zero();
  double radius_m = 0;
};

/// Whether an object has left a hand that never moves (docs/evaluation.md, "escape").
class EscapeTest {
 public:
  /// `radius_m`: of the object about its centre of mass. `hand_O`: the capsules in the object's frame at the
  /// start, which is the frame W of all poses given later.
  EscapeTest(const ObjectBody& object, double radius_m, std::vector<hands::PlacedCapsule> hand_O);

  /// The object's bounding ball has left the hand's.
  bool gone(const geometry::Pose& X_WO) const;
  /// The centre of mass is outside the convex hull of the capsules (162 half-spaces: a little larger).
  bool beside(const geometry::Pose& X_WO) const;
  /// The object can be moved along one of 162 straight ways by the sum of both balls' radii: no capsule gets
  /// more than 0.5 mm deep. With a locked axis: one of 40 ways across it. Milliseconds.
  bool straight_way_out(const geometry::Pose& X_WO, const std::optional<geometry::Vec3>& locked_W = {}) const;

  const Ball& object_ball() const { return object_; }  ///< in O, about the centre of mass
  const Ball& hand_ball() const { return hand_; }      ///< in W
  const std::vector<hands::PlacedCapsule>& capsules() const { return capsules_; }

 private:
  const geometry::SignedDistanceField& field_;
  std::vector<hands::PlacedCapsule> capsules_;
  Ball object_, hand_;
  std::vector<double> support_m_;  ///< of the capsules, along each of the 162 directions
};

/// Distance of the farthest vertex.
double radius_about_m(const geometry::TriangleMesh& mesh, const geometry::Vec3& center);

}  // namespace geocage::physics
