#include "cli/hand_pictures.h"

#include <cmath>

#include "datasets/shapes.h"
#include "geometry/distance_field.h"
#include "hands/caging.h"
#include "hands/closing.h"
#include "reports/hand_sheet.h"

namespace geocage::cli {

namespace {

using geometry::Pose;
using geometry::TriangleMesh;
using geometry::Vec3;

constexpr double step_m = 0.005, farthest_m = 0.2, aside_m = 0.015;

struct Prop {
  TriangleMesh mesh_O;
  geometry::SignedDistanceField field;
};

Prop prop(const TriangleMesh& mesh) {
  return {mesh, geometry::build_distance_field(mesh, {.cells = 64, .pad_m = 0.1, .refine = 3})};
}

/// Columns x, y, z with z along the approach and y along the flexion axis.
Eigen::Matrix3d grasp_frame(const hands::Hand& hand) {
  Eigen::Matrix3d frame;
  frame << hand.flexion_axis_H.cross(hand.approach_H), hand.flexion_axis_H, hand.approach_H;
  return frame;
}

double worth(const hands::Hand& hand, const Prop& prop, const Pose& X_OH, const hands::ClosedHand& closed) {
  std::vector<Pose> X_HL;
  std::vector<hands::PlacedCapsule> placed;
  hands::forward_kinematics(hand.tree, closed.q, X_HL);
  hands::place_capsules(hand, X_OH, X_HL, placed);
  return closed.fingers_touching + hands::blocked_share(prop.field, placed) +
         0.3 * hands::closure_margin(closed.contacts);
}

/// The object's axis along the axis the fingers bend about, its centre in front of the palm, as far away as
/// closes best.
reports::HandAtObject closed_on(const hands::Hand& hand, const Prop& prop) {
  reports::HandAtObject best{prop.mesh_O, Pose::Identity(), hand.open_rad};
  double most = -1;
  const Eigen::Matrix3d R_HG = grasp_frame(hand);
  for (double away = 0; away <= farthest_m; away += step_m)
    for (double aside : {0.0, -aside_m, aside_m}) {
      Pose X_HO = Pose::Identity();
      X_HO.translation() = hand.palm_H + R_HG * Vec3(aside, 0, away);
      X_HO.linear() = R_HG * Eigen::AngleAxisd(M_PI / 2, Vec3::UnitX()).toRotationMatrix();
      const Pose X_OH = X_HO.inverse();
      const auto closed = hands::close_hand(hand, prop.field, X_OH, hand.open_rad, {});
      if (closed.outcome == hands::Closure::blocked_at_start) continue;
      const double here = worth(hand, prop, X_OH, closed);
      if (here > most) most = here, best.X_OH = X_OH, best.q = closed.q;
    }
  return best;
}

}  // namespace

void write_hand_pictures(const std::vector<hands::Hand>& hands, const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder);
  TriangleMesh cup = datasets::cup(0.036, 0.09, 0.004, 64);
  for (Vec3& p : cup.vertices) p.z() -= 0.045;
  const std::vector<Prop> props = {prop(datasets::icosphere(0.034, 4)),
                                   prop(datasets::capped_cylinder(0.028, 0.17, 64)), prop(cup)};
  for (const hands::Hand& hand : hands) {
    if (hand.net) continue;
    std::vector<reports::HandAtObject> closed;
    for (const Prop& at : props) closed.push_back(closed_on(hand, at));
    reports::write_png(folder / (hand.name + ".png"), reports::hand_sheet(hand, closed));
  }
}

}  // namespace geocage::cli
