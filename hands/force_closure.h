#pragma once
#include <string_view>
#include <vector>

#include "hands/closing.h"

namespace geocage::hands {

/// What contacts may push with, and how torques are made comparable with forces (docs: hands/README.md).
struct FrictionModel {
  double mu = 0.6;               ///< Coulomb; 0 is one edge a contact
  int edges = 8;                 ///< of the pyramid in place of the cone, at least 3
  Vec3 center_O = Vec3::Zero();  ///< torques are about it: the centre of mass
  double torque_length_m =
      1;  ///< rho: torques are divided by it; the surface's largest distance from the centre
  /// Of soft fingers: the torsion about its normal that a contact resists, over mu and the normal force; two
  /// thirds of the radius of a round patch under even pressure. 0: points, which resist none.
  double torsion_m = 0;
};

/// Which part of the wrench must be resisted: forces alone are 3-D.
enum class WrenchPart { force, all };

enum class Resistance {
  force_closure,   ///< every wrench is resisted
  no_contact,      ///< there is nothing to push with
  rank_deficient,  ///< some wrench has no component in the span: frictionless contacts on a surface of
                   ///< revolution
  one_sided        ///< the origin is not inside the hull: some wrench pulls the object out
};
/// "force closure", "no contact", "rank deficient", "one-sided".
std::string_view name_of(Resistance resistance);

/// How well contacts resist (Ferrari and Canny 1992, metric L1: normal forces add up to 1 at most). `low` is
/// the radius of the largest ball around the origin inside the hull of 0 and all w_ij = (f_ij, p_i x f_ij /
/// rho), f_ij the edges of the inscribed pyramid; `high` that of the circumscribed pyramid. The true quality
/// of the round cone is in [low, high]; `high` is 0 where even the circumscribed pyramid leaves the origin
/// outside. A soft contact's tangential force f_t and torsion t keep within the ellipsoid |f_t|^2 + (t /
/// torsion_m)^2 <= (mu f_n)^2 (Howe and Cutkosky 1996); polyhedra take its place as pyramids take the cone's.
struct ForceClosure {
  Resistance outcome = Resistance::no_contact;
  double low = 0, high = 0;
  double volume = 0;  ///< of the inscribed hull, 6-D (3-D for forces); 0 unless force closure
};

/// Normals point inward, from finger to object; their contacts carry the outward one. O(hull): 1 to 100 ms
/// for 4 to 10 contacts. Throws std::runtime_error when the hull fails, which only contacts that are not
/// finite bring about.
ForceClosure force_closure(const std::vector<Contact>& contacts, const FrictionModel& model,
                           WrenchPart part = WrenchPart::all);

}  // namespace geocage::hands
