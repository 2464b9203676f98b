#pragma once
#include <vector>

#include "hands/closing.h"
#include "topology/polyline.h"

namespace geocage::hands {

/// Origins of the frames of a finger's links, base first, and its tip: the end of a capsule that is farthest
/// from the last link's origin.
std::vector<topology::Polyline> finger_lines(const Hand& hand, const Pose& X_OH, const Eigen::VectorXd& q);

/// Angle that each finger runs through about the line through `center_O` with unit direction `axis_O`: 2 pi
/// times the size of its winding number.
std::vector<double> wrap_angles_rad(const std::vector<topology::Polyline>& fingers, const Vec3& center_O,
                                    const Vec3& axis_O);

/// 2 pi less the largest gap between the contacts' directions about that line; 0 with fewer than two
/// contacts.
double contact_wrap_rad(const std::vector<Contact>& contacts, const Vec3& center_O, const Vec3& axis_O);

/// Share of 162 rays from `center_O` that meet the hand within 1 m.
double enclosed_share(const std::vector<PlacedCapsule>& capsules_O, const Vec3& center_O);

/// The loops that the hand closes, one a pair of fingers: tip - base - palm - base - tip, and back over the
/// gap between the tips. The last point is joined to the first.
std::vector<topology::Polyline> hand_loops(const std::vector<topology::Polyline>& fingers,
                                           const Vec3& palm_O);

/// The largest size, over the loops, of the Gauss linking integral with 2 m of the line. Near 1 for a hand
/// whose fingers meet behind the axis, near 0 for one that is beside it.
double axis_linking(const std::vector<topology::Polyline>& loops, const Vec3& center_O, const Vec3& axis_O);

/// The largest size of the linking number of a loop of the hand and a loop on the object (closed, last point
/// joined to the first): not 0 where the hand holds a handle like a link of a chain holds the next.
int handle_linking(const std::vector<topology::Polyline>& loops,
                   const std::vector<topology::Polyline>& handles_O);

/// The hand as a sheet: from the palm's centre over each pair of neighbouring fingers, as triangles between
/// their lines. Neighbours by angle about the approach; the sheet is closed around the palm and open at the
/// tips. Normals face where the hand closes to. With one finger or none it is empty.
geometry::TriangleMesh hand_sheet(const std::vector<topology::Polyline>& fingers, const Vec3& palm_O,
                                  const Vec3& approach_O);

}  // namespace geocage::hands
