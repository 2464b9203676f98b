#include <algorithm>
#include <cmath>
#include <set>

#include "physics/controls.h"
#include "physics/force_trial.h"
#include <gtest/gtest.h>

#include "pipeline/error.h"
#include "tests/physics/scenes.h"

namespace geocage::physics {
namespace {

/// The 48 motions and mirrors that take a cube to itself: axes in any order, with any signs.
std::vector<Eigen::Matrix3d> cube_group() {
  std::vector<Eigen::Matrix3d> group;
  std::array<int, 3> order = {0, 1, 2};
  do
    for (int signs = 0; signs < 8; ++signs) {
      Eigen::Matrix3d M = Eigen::Matrix3d::Zero();
      for (int axis = 0; axis < 3; ++axis) M(axis, order[axis]) = signs >> axis & 1 ? -1 : 1;
      group.push_back(M);
    }
  while (std::ranges::next_permutation(order).found);
  return group;
}

std::vector<Vec3> axes_of(const std::vector<Direction>& loads, bool turns) {
  std::vector<Vec3> axes;
  for (const Direction& load : loads)
    if (load.turns == turns) axes.push_back(load.axis_O);
  return axes;
}

// Unit vectors, no two alike, and the cube's own motions take each set to itself: so none is missing. Entries
// are 0, 1, 1/sqrt 2 and 1/sqrt 3 with one rounding: 1e-15 tells them apart.
TEST(Loads, are_faces_edges_and_corners_of_a_cube) {
  const std::pair<std::vector<Vec3>, std::size_t> sets[] = {{axes_of(six_directions(), false), 6},
                                                            {axes_of(find_loads("all"), false), 26},
                                                            {axes_of(find_loads("all"), true), 6}};
  for (const auto& [axes, count] : sets) {
    EXPECT_EQ(axes.size(), count);
    const auto among = [&](const Vec3& one) {
      return std::ranges::count_if(axes, [&](const Vec3& other) { return (one - other).norm() < 1e-15; });
    };
    for (const Vec3& axis : axes) {
      EXPECT_NEAR(axis.norm(), 1, 1e-15);
      for (const Eigen::Matrix3d& M : cube_group()) EXPECT_EQ(among(M * axis), 1);
    }
  }
  std::set<std::string> names;
  for (const Direction& load : find_loads("all")) names.insert(load.trial());
  EXPECT_EQ(names.size(), 32u);
  EXPECT_TRUE(names.contains("push +x-y+z") && names.contains("turn -y"));
}

TEST(Loads, six_come_first_and_unknown_ones_are_named) {
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_EQ(find_loads("all")[i].name, six_directions()[i].name);
    EXPECT_EQ(find_loads("all")[i].axis_O, six_directions()[i].axis_O);
  }
  try {
    find_loads("corners");
    FAIL();
  } catch (const pipeline::UserError& error) {
    EXPECT_NE(error.hint().find("axes, all"), std::string::npos);
  }
}

// A free body under a torque of m g r_g about a principal axis: symplectic Euler turns it by
// (m g r_g / I) t (t + dt) / 2, so the step at which it passes 15 degrees is known, and nothing shifts it.
TEST(Loads, a_free_body_turns_by_the_closed_form) {
  const double R = 0.05, r = 0.008, mass = 0.1;
  const auto field =
      filled(Vec3(0.09, 0.09, 0.04), 0.002, [&](const Vec3& p) { return torus_distance(p, R, r); });
  const ObjectBody ring = torus_body(field, R, r, mass);
  EXPECT_NEAR(gyration_m(ring), std::sqrt((2 * R * R + 2 * r * r) / 3), 1e-12);  // of the moments' sum
  const hands::Hand hand = hands::load_hand("parallel_2f");
  Pose X_OH = Pose::Identity();
  X_OH.translation().x() = 1;
  const Posture away = posture_at(hand, field, X_OH, hand.open_rad);
  const Protocol& protocol = find_protocol("geocage-force");
  for (const Direction& load : find_loads("all")) {
    if (!load.turns) continue;
    const double inertia = load.axis_O.cwiseAbs().dot(ring.inertia_kg_m2), dt = protocol.engine.dt_s;
    const double spin_up = mass * protocol.acceleration_m_s2 * gyration_m(ring) / inertia;
    const auto angle = [&](double t) { return spin_up * t * (t + dt) / 2; };
    const PushTrial trial = push_trial(protocol, ring, hand, away, load, 0);
    EXPECT_EQ(trial.outcome, Outcome::lost) << load.name;
    EXPECT_GE(angle(trial.ended_s), protocol.max_rotation_rad) << load.name;
    EXPECT_LT(angle(trial.ended_s - dt), protocol.max_rotation_rad) << load.name;
    EXPECT_NEAR(trial.rotation_rad, angle(trial.ended_s), 1e-9) << load.name;
    EXPECT_LT(trial.displacement_m, 1e-12) << load.name;
  }
}

// Every preset's engine keeps what can't leave, and loses what nothing stops.
TEST(KnownCages, answer_as_they_must_under_every_protocol) {
  for (const std::string& name : protocol_names()) {
    const auto controls = known_cages(find_protocol(name));
    ASSERT_EQ(controls.size(), 3u);
    for (const Control& control : controls)
      EXPECT_TRUE(control.ok()) << name << ", " << control.name << ": " << control.held << " of "
                                << control.trials;
    EXPECT_EQ(controls[0].trials + controls[1].trials + controls[2].trials, 6 + 6 + 2);
  }
}

// A solver that solves nothing lets the ball through the walls of its box.
TEST(KnownCages, tell_a_broken_engine) {
  Protocol broken = find_protocol("geocage-force");
  broken.engine.iterations = 0;
  const auto controls = known_cages(broken);
  EXPECT_FALSE(controls[0].ok());
  EXPECT_FALSE(controls[1].ok());
}

}  // namespace
}  // namespace geocage::physics
