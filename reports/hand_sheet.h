#pragma once
#include <vector>

#include "hands/hand.h"
#include "hands/net.h"
#include "reports/image.h"
#include "reports/picture.h"

namespace geocage::reports {

/// A hand closed on an object, both in the frame O of the object.
struct HandAtObject {
  TriangleMesh mesh_O;
  geometry::Pose X_OH;
  Eigen::VectorXd q;
};

/// The open hand and what it closes on, side by side on white, seen along the axis its fingers bend about:
/// square panels of `side` pixels.
Image hand_sheet(const hands::Hand& hand, const std::vector<HandAtObject>& closed, int side = 280);

/// A net on an object.
struct NetOnObject {
  TriangleMesh mesh_O;
  hands::Net net;
  View view;
};

/// Nets on their objects, side by side on white: square panels of `side` pixels.
Image net_sheet(const std::vector<NetOnObject>& nets, int side = 280);

}  // namespace geocage::reports
