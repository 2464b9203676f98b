#pragma once
#include <optional>
#include <vector>

#include "hands/closing.h"

namespace geocage::hands {

/// Unit vectors spread over the sphere: an icosahedron whose edges were halved `splits` times (12, 42, 162,
/// ...). The negative of each is one of them.
std::vector<Vec3> sphere_directions(int splits);

/// How far the capsules move along the unit vector `way_O` before one is more than 0.5 mm deep in the object,
/// to 1 mm; nothing when all get through `travel_m`. Walls thinner than 1.5 mm may be missed. Precondition:
/// the field's free border is at least 20 mm wide.
std::optional<double> free_travel_m(const geometry::SignedDistanceField& field,
                                    const std::vector<PlacedCapsule>& capsules_O, const Vec3& way_O,
                                    double travel_m);

/// Share of 42 directions in which the object, moved `travel_m` against the closed hand without turning, runs
/// into it: a capsule gets more than 0.5 mm deep. Below 1 a straight way out exists: almost no such hand
/// cages. Walls thinner than 1.5 mm may be missed.
double blocked_share(const geometry::SignedDistanceField& field, const std::vector<PlacedCapsule>& capsules_O,
                     double travel_m = 0.06);

/// The smallest over 162 directions d of the largest n.d of the contacts' outward normals: how surely some
/// contact resists each translation without friction; positive when all are (hands/README.md, "closure
/// margin"). In [-1, 1]; -1 without contacts.
double closure_margin(const std::vector<Contact>& contacts);

}  // namespace geocage::hands
