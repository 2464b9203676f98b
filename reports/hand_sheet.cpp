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

}  // namespace

Image hand_sheet(const hands::Hand& hand, const std::vector<HandAtObject>& closed, int side) {
  const int panels = 1 + static_cast<int>(closed.size());
  Image sheet{panels * side, side, std::vector<std::uint8_t>(4ul * panels * side * side, 255)};
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
    const std::vector<Colour> colours(at.mesh_O.vertices.size(), oklch(0.72, 0.12, 60));
    draw(at.X_OH, {{at.mesh_O, colours, {}}, hand_part(hand, at.X_OH, at.q)}, i);
  }
  return sheet;
}

}  // namespace geocage::reports
