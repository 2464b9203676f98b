#include "physics/world.h"

#include <cmath>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "tests/physics/scenes.h"

namespace geocage::physics {
namespace {

constexpr double gravity = 10, deg = std::numbers::pi / 180;

// Symplectic Euler falls g dt^2 n(n+1)/2 = g t (t + dt) / 2, exactly.
TEST(World, falls_freely_as_symplectic_euler_does) {
  const Vec3 half(0.02, 0.02, 0.02);
  const auto field =
      filled(Vec3(0.05, 0.05, 0.05), 0.005, [&](const Vec3& p) { return box_distance(p, half); });
  const ObjectBody box = box_body(field, half, 0.1);
  for (const double dt : {1e-3, 1.0 / 240}) {
    Engine engine;
    engine.dt_s = dt;
    World world(engine, box, rigid_hand({}), Pose::Identity(), Eigen::VectorXd(0), 0);
    const int steps = static_cast<int>(std::lround(1 / dt));
    for (int i = 0; i < steps; ++i) world.step(Vec3(0, 0, -0.1 * gravity));
    EXPECT_NEAR(world.X_WB().translation().z(), -5 * (1 + dt), 1e-9);
    EXPECT_NEAR(world.velocity_m_s().z(), -gravity, 1e-9);  // momentum = force x time
    EXPECT_EQ(world.spin_rad_s().norm(), 0);
  }
}

struct Slide {
  double distance_m, late_speed_m_s;
};

/// A block on two rails of a multibody, all turned by `yaw` about the normal, under a force tilted by
/// `slope`.
Slide slide(double yaw, double slope) {
  const Vec3 half(0.05, 0.05, 0.01);
  const auto field =
      filled(Vec3(0.09, 0.09, 0.05), 0.0025, [&](const Vec3& p) { return box_distance(p, half); });
  const double radius = 0.01, gap = 1e-4;
  std::vector<hands::Capsule> rails;
  for (const double y : {-0.03, 0.03}) rails.push_back({0, Vec3(-0.3, y, 0), Vec3(0.3, y, 0), radius});
  const Eigen::AngleAxisd turn(yaw, Vec3::UnitZ());
  Pose X_WO = Pose::Identity(), X_WH = Pose::Identity();
  X_WO.linear() = X_WH.linear() = turn.toRotationMatrix();
  X_WO.translation().z() = radius + half.z() + gap;

  World world({}, box_body(field, half, 0.1), rigid_hand(rails), X_WH, Eigen::VectorXd(0), 0, X_WO);
  const Vec3 force = 0.1 * gravity * (turn * Vec3(std::sin(slope), 0, -std::cos(slope)));
  for (int i = 0; i < 700; ++i) world.step(force);
  const double late = world.velocity_m_s().norm();
  return {(world.X_WB().translation() - X_WO.translation()).head<2>().norm(), late};
}

// Coulomb: a block slips where tan(slope) > mu, at 30.96 degrees for 0.6, whichever way the solver's two
// friction directions lie. One degree above it glides g (sin - mu cos) t^2 / 2 = 5.0 cm in 0.7 s; one below
// it must stay.
class Incline : public testing::TestWithParam<double> {};

TEST_P(Incline, slips_at_the_angle_of_friction) {
  const double critical = std::atan(0.6), yaw = GetParam() * deg;
  EXPECT_LT(slide(yaw, 25 * deg).late_speed_m_s, 1e-5);
  EXPECT_LT(slide(yaw, critical - 0.5 * deg).late_speed_m_s, 1e-5);
  const double above = critical + 1 * deg;
  const double glide = gravity * (std::sin(above) - 0.6 * std::cos(above)) * 0.7 * 0.7 / 2;
  EXPECT_NEAR(slide(yaw, above).distance_m, glide, 0.02 * glide);  // it lands on the rails first
}

INSTANTIATE_TEST_SUITE_P(Yaw, Incline, testing::Values(0.0, 22.5, 45.0));

/// A ring hung on a bar along z without friction, pulled by `direction` for 1 s.
struct Hanging {
  double farthest_m = 0, sideways_m = 0, energy_gain_j = -1, penetration_m = 0;
};

Hanging hang(const Vec3& direction) {
  const double R = 0.05, r = 0.008, bar = 0.006, mass = 0.1;
  const auto field =
      filled(Vec3(0.09, 0.09, 0.04), 0.002, [&](const Vec3& p) { return torus_distance(p, R, r); });
  Engine engine;
  engine.friction = 0;
  const hands::Hand hand = rigid_hand({{0, Vec3(0, 0, -0.5), Vec3(0, 0, 0.5), bar}});
  const ObjectBody ring = torus_body(field, R, r, mass);
  World world(engine, ring, hand, Pose::Identity(), Eigen::VectorXd(0), 0);
  const Vec3 force = mass * gravity * direction;
  Hanging seen;
  for (int i = 0; i < 1000; ++i) {
    world.step(force);
    const Vec3 p = world.X_WB().translation(), w = world.X_WB().linear().transpose() * world.spin_rad_s();
    seen.farthest_m = std::max(seen.farthest_m, p.norm());
    seen.sideways_m = std::max(seen.sideways_m, (p - p.dot(direction) * direction).norm());
    seen.penetration_m = std::max(seen.penetration_m, world.penetration_m());
    const double energy = 0.5 * mass * world.velocity_m_s().squaredNorm() +
                          0.5 * w.cwiseProduct(ring.inertia_kg_m2).dot(w) - force.dot(p);
    seen.energy_gain_j = std::max(seen.energy_gain_j, energy);
  }
  return seen;
}

// The ring may move until its inside meets the bar, R - r - bar = 3.6 cm, and never farther; along the bar it
// is free.
TEST(World, a_ring_on_a_bar_stays_in_its_plane_and_leaves_along_the_bar) {
  for (const Vec3& direction : {Vec3(1, 0, 0), Vec3(0, -1, 0), Vec3(0.6, 0.8, 0)}) {
    const Hanging ring = hang(direction);
    EXPECT_LT(ring.farthest_m, 0.036 + 1e-3) << direction.transpose();
    EXPECT_GT(ring.farthest_m, 0.036 - 1e-3) << direction.transpose();
    EXPECT_LT(ring.penetration_m, 5e-4);
    // Contacts may take energy, never give more than a hundredth of what a fall of 5 cm does.
    EXPECT_LT(ring.energy_gain_j, 0.01 * 0.1 * gravity * 0.05);
  }
  EXPECT_GT(hang(Vec3::UnitZ()).farthest_m, 1);
}

// Without friction the bar's push goes through the ring's centre, so the ring does not turn and its centre
// swings as a point on a string of L = R - r - bar: T = 2 pi sqrt(L / g) (1 + a^2 / 16). The field errs by
// 0.1 mm of 36, contacts give way by less, and the time step shifts a crossing by half a ms of 94: 1 % in
// all.
TEST(World, a_ring_on_a_bar_swings_as_a_pendulum) {
  const double R = 0.05, r = 0.008, bar = 0.006, mass = 0.1, length = R - r - bar, angle = 10 * deg;
  const auto field =
      filled(Vec3(0.09, 0.09, 0.04), 0.002, [&](const Vec3& p) { return torus_distance(p, R, r); });
  Engine engine;
  engine.friction = 0;
  const hands::Hand hand = rigid_hand({{0, Vec3(0, 0, -0.5), Vec3(0, 0, 0.5), bar}});
  Pose X_WO = Pose::Identity();
  X_WO.translation() = length * Vec3(std::sin(angle), -std::cos(angle), 0);
  World world(engine, torus_body(field, R, r, mass), hand, Pose::Identity(), Eigen::VectorXd(0), 0, X_WO);
  std::vector<double> crossings;
  double before = X_WO.translation().x();
  for (int step = 1; step <= 1000; ++step) {
    world.step(Vec3(0, -mass * gravity, 0));
    const double now = world.X_WB().translation().x();
    if ((before > 0) != (now > 0)) crossings.push_back(engine.dt_s * (step - now / (now - before)));
    before = now;
  }
  ASSERT_GE(crossings.size(), 4u);
  const double period = 2 * std::numbers::pi * std::sqrt(length / gravity) * (1 + angle * angle / 16);
  EXPECT_NEAR(crossings[2] - crossings[0], period, 0.01 * period);
  EXPECT_LT(world.spin_rad_s().norm(), 0.05);
}

/// A finger of one capsule on one joint that nothing drives or brakes, and its mass and inertia about its
/// middle, across its axis.
struct FreeFinger {
  hands::Hand hand;
  double mass_kg, across_kg_m2;
};

FreeFinger free_finger(hands::Joint::Type type, const Vec3& axis, const Vec3& a, const Vec3& b, double r) {
  hands::Joint joint;
  joint.name = "joint", joint.type = type, joint.child_link = 1, joint.axis_J = axis;
  joint.lower_rad = -10, joint.upper_rad = 10;
  FreeFinger finger{rigid_hand({{1, a, b, r}}), 0, 0};
  finger.hand.tree.links = {"base", "finger"}, finger.hand.tree.joints = {joint};
  finger.hand.tree.dof_names = {"joint"};
  const double length = (b - a).norm(), density = Engine{}.hand_density_kg_m3;
  const double rod = density * std::numbers::pi * r * r * length,
               caps = density * 4 / 3 * std::numbers::pi * r * r * r;
  finger.mass_kg = rod + caps;
  finger.across_kg_m2 = rod * (length * length / 12 + r * r / 4) +
                        caps * (0.4 * r * r + length * length / 4 + 0.375 * length * r);
  return finger;
}

constexpr double ball_m = 0.03, ball_kg = 0.1;

geometry::SignedDistanceField ball_field() {
  return filled(Vec3::Constant(0.07), 0.002, [](const Vec3& p) { return p.norm() - ball_m; });
}

ObjectBody ball_body(const geometry::SignedDistanceField& field) {
  return {&field, ball_kg, Pose::Identity(), Vec3::Constant(0.4 * ball_kg * ball_m * ball_m)};
}

// Momentum: a ball that flies into a finger on a free slide shares it, m v0 = m v + M V, and since nothing
// bounces both go on at v0 m / (m + M). The impulses on both bodies are one number of the solver, so the sum
// is kept to rounding; the common speed to what the last um of gap closes.
TEST(World, a_ball_shares_its_momentum_with_a_finger_that_slides) {
  const auto field = ball_field();
  const double r = 0.01, speed = 0.5;
  const FreeFinger finger =
      free_finger(hands::Joint::Type::prismatic, Vec3::UnitX(), Vec3(0, 0, -0.04), Vec3(0, 0, 0.04), r);
  Pose X_WO = Pose::Identity();
  X_WO.translation().x() = -(ball_m + r + 0.005);
  const Engine engine;
  World world(engine, ball_body(field), finger.hand, Pose::Identity(), Eigen::VectorXd::Zero(1), 0, X_WO);
  world.step(Vec3(ball_kg * speed / engine.dt_s, 0, 0));
  EXPECT_NEAR(world.velocity_m_s().x(), speed, 1e-12);
  for (int step = 0; step < 100; ++step) {
    const double before = world.hand().joints()[0];
    world.step(Vec3::Zero());
    const double link_m_s = (world.hand().joints()[0] - before) / engine.dt_s;
    const double momentum = ball_kg * world.velocity_m_s().x() + finger.mass_kg * link_m_s;
    ASSERT_NEAR(momentum, ball_kg * speed, 1e-9 * ball_kg * speed) << step;
  }
  const double shared = speed * ball_kg / (ball_kg + finger.mass_kg);
  EXPECT_NEAR(world.velocity_m_s().x(), shared, 1e-3 * shared);
}

// Angular momentum about a free hinge, without friction: a ball that hits at a distance b from the hinge
// turns the finger at m v0 b / (m b^2 + J). The sum is kept to rounding, the normal of the field to 1e-4 of
// the arm.
TEST(World, a_ball_shares_its_angular_momentum_with_a_finger_on_a_hinge) {
  const auto field = ball_field();
  const double r = 0.01, speed = 0.5, length = 0.1, b = 0.06, gap = 0.005;
  const FreeFinger finger =
      free_finger(hands::Joint::Type::revolute, Vec3::UnitZ(), Vec3::Zero(), Vec3(length, 0, 0), r);
  const double J = finger.across_kg_m2 + finger.mass_kg * length * length / 4;
  Pose X_WO = Pose::Identity();
  X_WO.translation() = Vec3(b, -(ball_m + r + gap), 0);
  Engine engine;
  engine.friction = 0;
  World world(engine, ball_body(field), finger.hand, Pose::Identity(), Eigen::VectorXd::Zero(1), 0, X_WO);
  world.step(Vec3(0, ball_kg * speed / engine.dt_s, 0));
  const double whole = ball_kg * speed * b, turned = whole / (ball_kg * b * b + J);
  const int hit = static_cast<int>(gap / speed / engine.dt_s);
  for (int step = 0; step < 40; ++step) {
    const double before = world.hand().joints()[0];
    world.step(Vec3::Zero());
    const double hinge_rad_s = (world.hand().joints()[0] - before) / engine.dt_s;
    const Vec3 p = world.X_WB().translation(), v = world.velocity_m_s();
    const double spin = 0.4 * ball_kg * ball_m * ball_m * world.spin_rad_s().z();
    ASSERT_NEAR(ball_kg * p.cross(v).z() + spin + J * hinge_rad_s, whole, 1e-9 * whole) << step;
    if (step == hit + 2) {
      EXPECT_NEAR(hinge_rad_s, turned, 1e-4 * turned);
    }
  }
}

// A ball that starts 2 mm inside a capsule leaves it with the bounded speed, not with erp d / dt = 0.4 m/s.
TEST(World, a_body_that_starts_inside_comes_out_slowly) {
  const double R = 0.03, r = 0.014, deep = 0.002;
  const auto field = filled(Vec3::Constant(0.07), 0.002, [&](const Vec3& p) { return p.norm() - R; });
  const ObjectBody ball{&field, 0.1, Pose::Identity(), Vec3::Constant(0.4 * 0.1 * R * R)};
  const double z = -(R + r - deep);
  const hands::Hand rail = rigid_hand({{0, Vec3(-0.05, 0, z), Vec3(0.05, 0, z), r}});
  const Engine engine;
  World world(engine, ball, rail, Pose::Identity(), Eigen::VectorXd(0), 0);
  double fastest = 0;
  for (int i = 0; i < 400; ++i) {
    world.step(Vec3::Zero());
    fastest = std::max(fastest, world.velocity_m_s().norm());
  }
  EXPECT_NEAR(fastest, engine.way_out_m_s, 1e-3 * engine.way_out_m_s);
  EXPECT_EQ(world.penetration_m(), 0);
}

// The positive control: a ball between six fat capsules with 0.5 mm of play, whatever pulls, without
// friction. Along an edge or a corner it may slide into the gap between capsules; geometry bounds that by a
// few times the play.
TEST(World, a_ball_in_a_closed_box_of_capsules_stays) {
  const double R = 0.03, r = 0.05, play = 5e-4, mass = 0.1;
  const auto field = filled(Vec3::Constant(0.09), 0.003, [&](const Vec3& p) { return p.norm() - R; });
  std::vector<hands::Capsule> walls;
  for (int axis = 0; axis < 3; ++axis)
    for (const double side : {1.0, -1.0}) {
      const Vec3 center = side * (R + r + play) * Vec3::Unit(axis), along = 0.02 * Vec3::Unit((axis + 1) % 3);
      walls.push_back({0, center - along, center + along, r});
    }
  const ObjectBody ball{&field, mass, Pose::Identity(), Vec3::Constant(0.4 * mass * R * R)};
  Engine engine;
  engine.friction = 0;
  for (int direction = 0; direction < 27; ++direction) {
    const Vec3 pull(direction % 3 - 1, direction / 3 % 3 - 1, direction / 9 - 1);
    World world(engine, ball, rigid_hand(walls), Pose::Identity(), Eigen::VectorXd(0), 0);
    for (int i = 0; i < 500; ++i) {
      world.step(5 * mass * gravity * pull);
      ASSERT_LT(world.X_WB().translation().norm(), 3 * play) << pull.transpose();
      ASSERT_LT(world.penetration_m(), 1e-4) << pull.transpose();
    }
  }
}

}  // namespace
}  // namespace geocage::physics
