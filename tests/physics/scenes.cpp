#include "tests/physics/scenes.h"

#include <cmath>

namespace geocage::physics {

double box_distance(const Vec3& p, const Vec3& half) {
  const Vec3 q = p.cwiseAbs() - half;
  return q.cwiseMax(0).norm() + std::min(q.maxCoeff(), 0.0);
}

double torus_distance(const Vec3& p, double R, double r) {
  return std::hypot(std::hypot(p.x(), p.y()) - R, p.z()) - r;
}

hands::Hand rigid_hand(std::vector<hands::Capsule> capsules) {
  hands::Hand hand;
  hand.name = "rails";
  hand.tree.links = {"base"};
  hand.capsules = std::move(capsules);
  return hand;
}

ObjectBody box_body(const geometry::SignedDistanceField& field, const Vec3& half, double mass_kg) {
  const Vec3 square = half.cwiseProduct(half);
  const Vec3 inertia =
      mass_kg / 3 * Vec3(square.y() + square.z(), square.x() + square.z(), square.x() + square.y());
  return {&field, mass_kg, Pose::Identity(), inertia};
}

ObjectBody torus_body(const geometry::SignedDistanceField& field, double R, double r, double mass_kg) {
  const double along = mass_kg * (R * R + 0.75 * r * r), across = mass_kg * (0.5 * R * R + 0.625 * r * r);
  return {&field, mass_kg, Pose::Identity(), Vec3(across, across, along)};
}

}  // namespace geocage::physics
