#pragma once
#include <functional>

#include "geometry/distance_field.h"
#include "hands/hand.h"
#include "physics/world.h"

namespace geocage::physics {

using geometry::Pose;
using geometry::Vec3;

/// A field filled from a formula, over the box [-half, half].
geometry::SignedDistanceField filled(const Vec3& half, double cell_m,
                                     const std::function<double(const Vec3&)>& f);

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
