#include "cli/hand_pictures.h"

#include <cmath>

#include "datasets/shapes.h"
#include "geometry/distance_field.h"
#include "hands/caging.h"
#include "hands/closing.h"
#include "hands/net.h"
#include "reports/hand_sheet.h"
#include "stages/remesh/remesh.h"

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
  const auto placed = hands::placed_capsules(hand, X_OH, closed.q);
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

constexpr double net_edge_m = 0.008;  // coarse enough to be seen

/// The net over the side of an object (+x), laid or drawn tight.
reports::NetOnObject net_on(const hands::Hand& hand, const Prop& prop, bool tight) {
  pipeline::Run run;
  const auto even = stages::remesh({.edge_length_m = net_edge_m}, run, prop.mesh_O);
  int side = 0;
  for (int v = 1; v < static_cast<int>(even.vertices.size()); ++v)
    if (even.vertices[v].x() - std::abs(even.vertices[v].z()) >
        even.vertices[side].x() - std::abs(even.vertices[side].z()))
      side = v;
  const hands::TighteningRule rule{.steps = tight ? hands::TighteningRule{}.steps : 0};
  return {prop.mesh_O,
          hands::tighten_net(hand, even, prop.field, side, hand.ball_radius_m, -Vec3::UnitX(), rule),
          {Vec3(1, -0.7, 0.5).normalized(), Vec3::UnitZ()}};
}

}  // namespace

void write_hand_pictures(const std::vector<hands::Hand>& hands, const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder);
  TriangleMesh cup = datasets::cup(0.036, 0.09, 0.004, 64);
  for (Vec3& p : cup.vertices) p.z() -= 0.045;
  const std::vector<Prop> props = {prop(datasets::icosphere(0.034, 4)),
                                   prop(datasets::capped_cylinder(0.028, 0.17, 64)), prop(cup)};
  for (const hands::Hand& hand : hands) {
    if (hand.net) {
      std::vector<reports::NetOnObject> nets = {net_on(hand, props.front(), false)};
      for (const Prop& at : props) nets.push_back(net_on(hand, at, true));
      reports::write_png(folder / (hand.name + ".png"), reports::net_sheet(nets));
      continue;
    }
    std::vector<reports::HandAtObject> closed;
    closed.reserve(props.size());
    for (const Prop& at : props) closed.push_back(closed_on(hand, at));
    reports::write_png(folder / (hand.name + ".png"), reports::hand_sheet(hand, closed));
  }
}

}  // namespace geocage::cli
