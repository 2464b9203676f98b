#include "tests/physics/scenes.h"

#include <cmath>

namespace geocage::physics {

geometry::SignedDistanceField filled(const Vec3& half, double cell_m,
                                     const std::function<double(const Vec3&)>& f) {
  geometry::SignedDistanceField field;
  field.origin = -half, field.cell_m = cell_m;
  for (int axis = 0; axis < 3; ++axis)
    field.nodes[axis] = static_cast<int>(std::ceil(2 * half[axis] / cell_m)) + 1;
  for (int z = 0; z < field.nodes[2]; ++z)
    for (int y = 0; y < field.nodes[1]; ++y)
      for (int x = 0; x < field.nodes[0]; ++x)
        field.coarse.push_back(static_cast<float>(f(field.origin + cell_m * Vec3(x, y, z))));
  field.block.assign((field.nodes[0] - 1) * (field.nodes[1] - 1) * (field.nodes[2] - 1), -1);
  return field;
}

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
