#pragma once
#include <array>

#include "hands/closing.h"

namespace geocage::hands {

/// Balls of one radius, tied along edges: a net that was laid over a piece of a surface and drawn tight.
struct Net {
  std::vector<Vec3> points_O;
  std::vector<std::array<int, 2>> edges;
  double point_radius_m = 0;
  std::vector<Contact> contacts;  ///< of the points; their `link` is the point's number
  double penetration_m = 0;       ///< deepest of the points
  double stretch = 0;             ///< longest edge over its rest length, less 1
};

struct TighteningRule {
  int steps = 300;
  double step_m = 0.0005;     ///< a point is drawn that far in the first step; the pull fades to nothing
  double contact_m = 0.0025;  ///< points nearer than this are contacts
};

/// Lays a net over the vertices within `radius_m` of `vertex` (hops times the mean edge length, as geodesic
/// balls are), displaced along their normals by the hand's offset, and draws it along `inward_O` and towards
/// its own middle until it lies on the object (thesis 6.3.1; method: position-based dynamics, Mueller et al.
/// 2007, with one-sided distance constraints). An edge keeps its length up to the hand's stretch share; the
/// points of its ends are kept off the object by the field. O(steps x edges). Precondition: `hand.net`.
Net tighten_net(const Hand& hand, const geometry::TriangleMesh& mesh,
                const geometry::SignedDistanceField& field, int vertex, double radius_m, const Vec3& inward_O,
                const TighteningRule& rule = {});

/// The net as capsules along its edges: what blocks an object that moves as one against the net that stays.
std::vector<PlacedCapsule> net_capsules(const Net& net);

}  // namespace geocage::hands
