#include "reports/hand_sheet.h"

#include <cmath>

#include "reports/scenes.h"

namespace geocage::reports {

namespace {

/// Copies a panel onto white, its left edge at `left`.
void paste(const Image& panel, int left, Image& sheet) {
  for (int y = 0; y < panel.height; ++y)
    for (int x = 0; x < panel.width; ++x) {
      const std::uint8_t* from = &panel.rgba[4ul * (y * panel.width + x)];
      std::uint8_t* to = &sheet.rgba[4ul * (y * sheet.width + left + x)];
      for (int channel = 0; channel < 3; ++channel)
        to[channel] = static_cast<std::uint8_t>(255 - from[3] * (255 - from[channel]) / 255);
      to[3] = 255;
    }
}

Part object_part(const TriangleMesh& mesh) {
  return {mesh, std::vector<Colour>(mesh.vertices.size(), oklch(0.72, 0.12, 60)), {}};
}

Image blank(int panels, int side) {
  return {panels * side, side, std::vector<std::uint8_t>(4ul * panels * side * side, 255)};
}

/// Points as balls, and edges a third as thick.
std::vector<Part> net_parts(const hands::Net& net) {
  const Colour points = oklch(0.42, 0.015, 250), edges = oklch(0.86, 0.012, 250);
  std::vector<Part> parts = {ball_part(net.points_O, net.point_radius_m, points)};
  for (const auto& [a, b] : net.edges)
    parts.push_back(capsule_part(net.points_O[a], net.points_O[b], net.point_radius_m / 3, edges));
  return parts;
}

}  // namespace

Image hand_sheet(const hands::Hand& hand, const std::vector<HandAtObject>& closed, int side) {
  const int panels = 1 + static_cast<int>(closed.size());
  Image sheet = blank(panels, side);
  const Vec3 across_H = hand.flexion_axis_H.cross(hand.approach_H);
  const Vec3 from_H = hand.flexion_axis_H + 0.35 * across_H + 0.3 * hand.approach_H;
  const PictureStyle style{.width = side, .height = side, .ground = false};
  const auto draw = [&](const geometry::Pose& X_OH, std::vector<Part> parts, int panel) {
    const View view{X_OH.linear() * from_H.normalized(), X_OH.linear() * hand.approach_H};
    paste(Studio(std::move(parts)).picture(view, style), panel * side, sheet);
  };
  const auto at_rest = geometry::Pose::Identity();
  draw(at_rest, {hand_part(hand, at_rest, hand.open_rad)}, 0);
  for (int i = 1; i < panels; ++i) {
    const HandAtObject& at = closed[i - 1];
    draw(at.X_OH, {object_part(at.mesh_O), hand_part(hand, at.X_OH, at.q)}, i);
  }
  return sheet;
}

Image net_sheet(const std::vector<NetOnObject>& nets, int side) {
  Image sheet = blank(static_cast<int>(nets.size()), side);
  int left = 0;
  for (const NetOnObject& at : nets) {
    std::vector<Part> parts = net_parts(at.net);
    parts.push_back(object_part(at.mesh_O));
    paste(Studio(std::move(parts)).picture(at.view, {.width = side, .height = side, .ground = false}), left,
          sheet);
    left += side;
  }
  return sheet;
}

}  // namespace geocage::reports
