#include "hands/measures.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "hands/caging.h"
#include "topology/linking.h"
#include "topology/winding_number.h"
#include "topology/writhe.h"

namespace geocage::hands {

using topology::Polyline;

namespace {

constexpr double two_pi = 2 * std::numbers::pi;

double angle_about(const Vec3& p, const Vec3& center, const Vec3& axis) {
  const Eigen::Matrix3d frame = geometry::frame_from_z(axis);
  return std::atan2(frame.col(1).dot(p - center), frame.col(0).dot(p - center));
}

/// `count` points of the line, evenly spaced in its length.
Polyline resampled(const Polyline& line, int count) {
  std::vector<double> length = {0};
  for (std::size_t i = 1; i < line.size(); ++i)
    length.push_back(length.back() + (line[i] - line[i - 1]).norm());
  Polyline points;
  std::size_t at = 1;
  for (int k = 0; k < count; ++k) {
    const double wanted = length.back() * k / (count - 1);
    while (at + 1 < line.size() && length[at] < wanted) ++at;
    const double whole = length[at] - length[at - 1];
    points.push_back(line[at - 1] +
                     (whole > 0 ? (wanted - length[at - 1]) / whole : 0) * (line[at] - line[at - 1]));
  }
  return points;
}

}  // namespace

std::vector<Polyline> finger_lines(const Hand& hand, const Pose& X_OH, const Eigen::VectorXd& q) {
  std::vector<Pose> X_HL;
  std::vector<PlacedCapsule> placed;
  forward_kinematics(hand.tree, q, X_HL);
  place_capsules(hand, X_OH, X_HL, placed);
  std::vector<Polyline> lines;
  for (const Finger& finger : hand.fingers) {
    std::vector<int> links = finger.links;
    std::sort(links.begin(), links.end());  // parents first
    Polyline line;
    for (int link : links) line.push_back(X_OH * X_HL[link].translation());
    Vec3 tip = line.back();
    for (std::size_t i = 0; i < placed.size(); ++i)
      for (const Vec3& end : {placed[i].a, placed[i].b})
        if (hand.capsules[i].link == links.back() && (end - line.back()).norm() > (tip - line.back()).norm())
          tip = end;
    line.push_back(tip);
    lines.push_back(std::move(line));
  }
  return lines;
}

std::vector<double> wrap_angles_rad(const std::vector<Polyline>& fingers, const Vec3& center_O,
                                    const Vec3& axis_O) {
  std::vector<double> angles;
  angles.reserve(fingers.size());
  for (const Polyline& finger : fingers)
    angles.push_back(two_pi * std::abs(topology::winding_number(finger, center_O, axis_O)));
  return angles;
}

double contact_wrap_rad(const std::vector<Contact>& contacts, const Vec3& center_O, const Vec3& axis_O) {
  if (contacts.size() < 2) return 0;
  std::vector<double> angles;
  angles.reserve(contacts.size());
  for (const Contact& contact : contacts) angles.push_back(angle_about(contact.p_O, center_O, axis_O));
  std::sort(angles.begin(), angles.end());
  double gap = angles.front() + two_pi - angles.back();
  for (std::size_t i = 1; i < angles.size(); ++i) gap = std::max(gap, angles[i] - angles[i - 1]);
  return two_pi - gap;
}

double enclosed_share(const std::vector<PlacedCapsule>& capsules_O, const Vec3& center_O) {
  static const std::vector<Vec3> directions = sphere_directions(2);
  const auto met = [&](const Vec3& direction) {
    const PlacedCapsule ray{center_O, center_O + direction, 0};
    return std::any_of(capsules_O.begin(), capsules_O.end(),
                       [&](const PlacedCapsule& capsule) { return capsule_gap_m(ray, capsule) <= 0; });
  };
  return static_cast<double>(std::count_if(directions.begin(), directions.end(), met)) /
         static_cast<double>(directions.size());
}

std::vector<Polyline> hand_loops(const std::vector<Polyline>& fingers, const Vec3& palm_O) {
  std::vector<Polyline> loops;
  for (std::size_t i = 0; i < fingers.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) {
      Polyline loop(fingers[i].rbegin(), fingers[i].rend());
      loop.push_back(palm_O);
      loop.insert(loop.end(), fingers[j].begin(), fingers[j].end());
      loops.push_back(std::move(loop));
    }
  return loops;
}

double axis_linking(const std::vector<Polyline>& loops, const Vec3& center_O, const Vec3& axis_O) {
  const Polyline line = {center_O - axis_O, center_O + axis_O};
  double most = 0;
  for (Polyline loop : loops) {
    loop.push_back(loop.front());
    most = std::max(most, std::abs(topology::gauss_linking_integral(loop, line)));
  }
  return most;
}

int handle_linking(const std::vector<Polyline>& loops, const std::vector<Polyline>& handles_O) {
  int most = 0;
  for (const Polyline& loop : loops)
    for (const Polyline& handle : handles_O)
      most = std::max(most, std::abs(topology::linking_number(loop, handle).value));
  return most;
}

geometry::TriangleMesh hand_sheet(const std::vector<Polyline>& fingers, const Vec3& palm_O,
                                  const Vec3& approach_O) {
  constexpr int points = 6;  // along a finger
  geometry::TriangleMesh sheet;
  const int n = static_cast<int>(fingers.size());
  if (n < 2) return sheet;
  std::vector<Polyline> lines = fingers;
  std::sort(lines.begin(), lines.end(), [&](const Polyline& a, const Polyline& b) {
    return angle_about(a.front(), palm_O, approach_O) < angle_about(b.front(), palm_O, approach_O);
  });
  sheet.vertices.push_back(palm_O);
  for (const Polyline& line : lines)
    for (const Vec3& p : resampled(line, points)) sheet.vertices.push_back(p);
  for (int i = 0; i < n; ++i) {
    const int here = 1 + i * points, there = 1 + (i + 1) % n * points;
    sheet.triangles.push_back({0, here, there});
    for (int k = 0; k + 1 < points; ++k) {
      sheet.triangles.push_back({here + k, here + k + 1, there + k});
      sheet.triangles.push_back({there + k, here + k + 1, there + k + 1});
    }
  }
  return sheet;
}

}  // namespace geocage::hands
