#pragma once
#include "physics/formula_field.h"
#include "physics/world.h"

#include "geometry/distance_field.h"
#include "hands/hand.h"

namespace geocage::physics {

using geometry::Pose;
using geometry::Vec3;

double box_distance(const Vec3& p, const Vec3& half);
/// Ring around z: R to the tube's centre, r the tube.
double torus_distance(const Vec3& p, double R, double r);

/// A "hand" of nothing but capsules on its base.
hands::Hand rigid_hand(std::vector<hands::Capsule> capsules);

/// Box of `half` extents, even density.
ObjectBody box_body(const geometry::SignedDistanceField& field, const Vec3& half, double mass_kg);
/// Solid torus, even density, about its centre (closed form).
ObjectBody torus_body(const geometry::SignedDistanceField& field, double R, double r, double mass_kg);

}  // namespace geocage::physics
