#include <cmath>
#include <numbers>

#include "physics/back_off.h"
#include "physics/cage_trial.h"
#include "physics/compliant_trial.h"
#include "physics/escape_search.h"
#include "physics/survival.h"
#include <gtest/gtest.h>

#include "tests/physics/scenes.h"

namespace geocage::physics {
namespace {

using hands::PlacedCapsule;

constexpr double R = 0.05, r = 0.008, bar_m = 0.006, mass = 0.1;

const geometry::SignedDistanceField& ring_field() {
  static const auto field =
      filled(Vec3(0.09, 0.09, 0.04), 0.002, [](const Vec3& p) { return torus_distance(p, R, r); });
  return field;
}

ObjectBody ring() {
  return torus_body(ring_field(), R, r, mass);
}

/// A bar along z through the middle of the ring, and where there are end stops a fence of bars at each end,
/// farther apart than the ring is thick, closer than it is wide.
std::vector<PlacedCapsule> bar(bool stops) {
  std::vector<PlacedCapsule> capsules = {{Vec3(0, 0, -0.06), Vec3(0, 0, 0.06), bar_m}};
  for (const double z : {-0.06, 0.06})
    for (int spoke = 0; stops && spoke < 6; ++spoke) {
      const double angle = spoke * std::numbers::pi / 3;
      capsules.push_back({Vec3(0, 0, z), Vec3(0.12 * std::cos(angle), 0.12 * std::sin(angle), z), bar_m});
    }
  return capsules;
}

EscapeTest around_ring(bool stops) {
  return {ring(), R + r, bar(stops)};
}

// Hung on a bar without friction a ring stays in its plane and leaves along the bar; end stops hold it there.
TEST(Cage, a_ring_on_a_bar_leaves_along_the_bar_only_and_end_stops_hold_it) {
  const CageProtocol protocol;
  const ObjectBody body = ring();
  for (const Vec3& way : {Vec3(1, 0, 0), Vec3(0, -1, 0), Vec3(-0.6, 0.8, 0)})
    EXPECT_EQ(pull_trial(protocol, body, around_ring(true), way, 0).outcome, Outcome::held);
  for (const double side : {1.0, -1.0}) {
    const Vec3 way = side * Vec3::UnitZ();
    EXPECT_EQ(pull_trial(protocol, body, around_ring(false), way, 0).outcome, Outcome::lost);
    EXPECT_EQ(pull_trial(protocol, body, around_ring(true), way, 0).outcome, Outcome::held);
  }
}

// The ring test locks the axis: the bar without end stops is a cage for it, in every direction of the plane.
TEST(Cage, the_ring_test_asks_about_the_plane_only) {
  const CageProtocol protocol;
  for (int k = 0; k < 4; ++k) {
    const CageTrial trial =
        ring_trial(protocol, ring(), around_ring(false), Vec3::UnitZ(), k * std::numbers::pi / 2, 0);
    EXPECT_EQ(trial.outcome, Outcome::held) << k;
    EXPECT_NEAR(trial.max_displacement_m, R - r - bar_m, 1e-3) << k;  // until its inside meets the bar
  }
  // A bar beside the ring holds nothing.
  const EscapeTest beside(ring(), R + r, {{Vec3(0.1, 0, -0.06), Vec3(0.1, 0, 0.06), bar_m}});
  EXPECT_EQ(ring_trial(protocol, ring(), beside, Vec3::UnitZ(), 0, 0).outcome, Outcome::lost);
}

// Random wrenches find the way out of the bare bar in 10 s, never that of the bar with end stops, and the
// walls stay walls.
TEST(Cage, random_wrenches_find_the_open_end) {
  const CageProtocol protocol;
  for (std::uint64_t seed = 0; seed < 4; ++seed) {
    EXPECT_EQ(wrench_trial(protocol, ring(), around_ring(false), 2, seed).outcome, Outcome::lost) << seed;
    const CageTrial stopped = wrench_trial(protocol, ring(), around_ring(true), 2, seed);
    EXPECT_EQ(stopped.outcome, Outcome::held) << seed;
    EXPECT_LT(stopped.penetration_m, 2e-3) << seed;  // half the tube is 8 mm
  }
}

// The positive control: a ball in a box of six fat capsules with 0.5 mm of play stays whatever pulls. Its
// field is as fine as a real object's: one of 3 mm has normals a degree off, which at 6 m/s of spin screw the
// ball 3 mm in.
TEST(Cage, a_ball_in_a_closed_box_stays) {
  const double ball_m = 0.03, wall_m = 0.05, play = 5e-4;
  const auto field = filled(Vec3::Constant(0.09), 0.002, [&](const Vec3& p) { return p.norm() - ball_m; });
  std::vector<PlacedCapsule> walls;
  for (int axis = 0; axis < 3; ++axis)
    for (const double side : {1.0, -1.0}) {
      const Vec3 center = side * (ball_m + wall_m + play) * Vec3::Unit(axis),
                 along = 0.02 * Vec3::Unit((axis + 1) % 3);
      walls.push_back({center - along, center + along, wall_m});
    }
  const ObjectBody ball{&field, mass, Pose::Identity(), Vec3::Constant(0.4 * mass * ball_m * ball_m)};
  const EscapeTest escape(ball, ball_m, walls);
  CageProtocol protocol;
  for (const double amplitude : {1.0, 5.0, 20.0})
    for (std::uint64_t seed = 0; seed < 5; ++seed) {
      const CageTrial trial = wrench_trial(protocol, ball, escape, amplitude, seed);
      EXPECT_EQ(trial.outcome, Outcome::held);
      EXPECT_LT(trial.penetration_m, CageEngine{}.most_motion_m);  // what one step may close
    }
}

// What nothing holds is lost at any amplitude, what nothing lets go at none: a_50 is below, or above, all.
TEST(Cage, half_amplitude_of_a_free_and_of_a_caged_ring_are_censored) {
  const EscapeTest nothing(ring(), R + r, {{Vec3(1, 0, -0.06), Vec3(1, 0, 0.06), bar_m}});
  const auto half = [&](const EscapeTest& escape) {
    std::vector<AmplitudeShare> shares;
    for (const double amplitude : {0.5, 1.0, 2.0, 5.0}) {
      std::vector<Life> lives;
      for (std::uint64_t seed = 0; seed < 2; ++seed) {
        const CageTrial trial = wrench_trial({}, ring(), escape, amplitude, seed);
        lives.push_back({trial.ended_s, trial.outcome == Outcome::lost});
      }
      shares.push_back({amplitude, share_at(survival(lives), CageProtocol{}.wrench_s), 2});
    }
    return half_amplitude(shares)->text();
  };
  EXPECT_EQ(half(nothing), "below 0.5");
  EXPECT_EQ(half(around_ring(true)), "above 5");
}

// Symplectic Euler without damping: z = g t (t + dt) / 2, exactly.
TEST(Cage, falls_freely_as_symplectic_euler_does) {
  CageEngine engine;
  engine.damping_s = 0;
  engine.most_motion_m = 1e9;
  CageWorld world(engine, ring(), 0, {}, Pose::Identity(), 0);
  for (int i = 0; i < 240; ++i) world.step(Vec3(0, 0, -mass * 10), Vec3::Zero());
  EXPECT_NEAR(world.X_WB().translation().z(), -5 * (1 + engine.dt_s), 1e-9);
}

/// A "hand" without joints.
hands::Hand fixed_hand(const std::vector<PlacedCapsule>& capsules) {
  std::vector<hands::Capsule> on_base;
  for (const PlacedCapsule& one : capsules) on_base.push_back({0, one.a, one.b, one.radius_m});
  return rigid_hand(on_base);
}

// A hand that can't give way answers as the locked one does, in the other world, with the other solver.
TEST(Compliance, without_joints_is_the_locked_hand) {
  const CageProtocol protocol;
  for (const bool stops : {true, false})
    for (const Vec3& way : {Vec3(1, 0, 0), Vec3(0, 0, 1), Vec3(0, 0, -1)}) {
      const CageTrial locked = pull_trial(protocol, ring(), around_ring(stops), way, 0);
      const CageTrial compliant =
          compliant_pull(protocol, ring(), R + r, fixed_hand(bar(stops)), {Pose::Identity(), {}, 0}, way, 0);
      EXPECT_EQ(compliant.outcome, locked.outcome) << stops << " " << way.transpose();
    }
}

// The jaws of a gripper, driven by one motor of F = 20 N, hold a box between them against 1 N along the way
// they close, and are pushed open by 200 N.
TEST(Compliance, jaws_give_way_to_more_than_their_motors_force) {
  const hands::Hand gripper = hands::load_hand("parallel_2f");
  const Vec3 half = Vec3::Constant(0.0125);
  const auto field =
      filled(Vec3::Constant(0.05), 0.001, [&](const Vec3& p) { return box_distance(p, half); });
  Pose X_OH = Pose::Identity();
  X_OH.translation().z() = -(0.112 + 0.01875);  // the middle of its pads
  const Posture posture = posture_at(gripper, field, X_OH, Eigen::VectorXd::Constant(1, 0.0427 - half.y()));
  const auto moved = [&](double mass_kg) {
    return compliant_pull({}, box_body(field, half, mass_kg), half.norm(), gripper, posture, Vec3::UnitY(), 0)
        .max_displacement_m;
  };
  EXPECT_LT(moved(0.1), 1e-3);
  EXPECT_GT(moved(20), 5e-3);
}

// Raised by 5 cm, then carried down to 20 cm below the start and 10 cm along x.
TEST(Escape, rises_are_the_highest_point_against_each_gravity) {
  const std::vector<Pose> path = {Pose::Identity(), Pose(Eigen::Translation3d(0, 0, 0.05)),
                                  Pose(Eigen::Translation3d(0.1, 0, -0.2))};
  const std::vector<double> expected = {0, 0.1, 0, 0, 0.2, 0.05};  // gravity along +x -x +y -y +z -z
  const auto rises = rises_m(path, Vec3::Zero());
  ASSERT_EQ(rises.size(), 6u);
  for (std::size_t i = 0; i < 6; ++i) EXPECT_NEAR(rises[i], expected[i], 1e-15) << i;
}

// Searches of several seeds count their finds, and keep the lowest rise of each gravity.
TEST(Escape, searches_of_several_seeds_are_one) {
  const EscapeTest open = around_ring(false);
  std::vector<EscapeSearch> searches;
  for (std::uint64_t seed = 0; seed < 3; ++seed)
    searches.push_back(search_escape(ring_field(), open, {.samples = 200}, seed));
  const EscapeSearch all = merged(searches);
  EXPECT_EQ(all.seeds, 3);
  EXPECT_EQ(all.found, 3);
  EXPECT_EQ(all.path_m, searches[0].path_m);
  for (std::size_t i = 0; i < 6; ++i)
    EXPECT_EQ(all.rise_m[i], std::min({searches[0].rise_m[i], searches[1].rise_m[i], searches[2].rise_m[i]}));
  searches[0] = search_escape(ring_field(), around_ring(true), {.samples = 200}, 0);
  EXPECT_EQ(merged(searches).found, 2);
  EXPECT_EQ(merged(searches).result, EscapeSearch::Result::found);
}

// A ball of 30 mm in a well of twelve upright bars, too close to each other for it. The cheapest way out goes
// between two tips: with centres of the tips d apart and b + rho from the ball's, at t + sqrt((b + rho)^2 -
// d^2 / 4). The way may cut tips by `tolerance_m`, which lowers it by 0.5 mm times (b + rho) over that root.
// Ceilings come within an eighth of the first way's rise in three halvings, and a search needs room: half
// more.
TEST(Escape, bisection_finds_the_rim_of_a_well) {
  constexpr double rho = 0.03, c = 0.045, b = 0.005, t = 0.02;
  const auto field = filled(Vec3::Constant(0.05), 0.002, [](const Vec3& p) { return p.norm() - rho; });
  std::vector<PlacedCapsule> well;
  for (int i = 0; i < 12; ++i) {
    const double angle = i * std::numbers::pi / 6;
    const Vec3 foot(c * std::cos(angle), c * std::sin(angle), -0.06);
    well.push_back({foot, {foot.x(), foot.y(), t}, b});
  }
  well.push_back({Vec3(-c, 0, -0.06), Vec3(c, 0, -0.06), b});
  well.push_back({Vec3(0, -c, -0.06), Vec3(0, c, -0.06), b});
  const EscapeTest escape(box_body(field, Vec3::Constant(rho), 0.1), rho, well);
  const double half = c * std::sin(std::numbers::pi / 12);
  const double root = std::sqrt((b + rho) * (b + rho) - half * half), rim = t + root;
  const EscapeSearchRule rule{.samples = 3000};
  const EscapeSearch first = search_escape(field, escape, rule, 0);
  ASSERT_EQ(first.result, EscapeSearch::Result::found);
  const Vec3 down = -Vec3::UnitZ();
  const RiseBound bound = lower_rise(field, escape, rule, 0, 2, down, first.rise_m[5], 3);
  EXPECT_GE(bound.rise_m, rim - rule.tolerance_m * (b + rho) / root - 1e-6);
  EXPECT_LE(bound.rise_m, 1.5 * rim);
  EXPECT_LT(bound.unfound_m, bound.rise_m);
  EXPECT_LE(bound.rise_m, first.rise_m[5]);
  // Under a ceiling below the rim there is no way.
  EXPECT_EQ(search_escape(field, escape, rule, 1, Ceiling{down, 0.9 * rim}).found, 0);
}

// v' = g - v / tau has v = g tau (1 - exp(-t / tau)), and a step ends there whatever its length; z lags
// behind the integral of v by less than v dt.
TEST(Cage, damped_falls_have_the_closed_forms_speed_at_any_step) {
  for (const double dt_s : {1.0 / 240, 1.0 / 480, 1.0 / 1000}) {
    CageEngine engine;
    engine.dt_s = dt_s;
    CageWorld world(engine, ring(), 0, {}, Pose::Identity(), 0);
    const double tau = engine.damping_s, speed = 10 * tau;
    for (int i = 1; i * dt_s < 0.5; ++i) {
      world.step(Vec3(0, 0, -mass * 10), Vec3::Zero());
      const double t = i * dt_s, way = 1 - std::exp(-t / tau);
      EXPECT_NEAR(world.velocity_m_s().z(), -speed * way, 1e-12) << t;
      const double z = -speed * (t - tau * way);
      EXPECT_LE(world.X_WB().translation().z(), z);
      EXPECT_GE(world.X_WB().translation().z(), z - speed * way * dt_s);
    }
  }
}

// A capsule that starts 2 mm inside a ball moves out by 2 mm and the gap, along the line of centres; one that
// is free stays where it is, bit by bit.
TEST(Cage, fingers_that_start_inside_back_off_by_their_depth) {
  const double ball_m = 0.03, finger_m = 0.01, deep_m = 0.002, gap_m = 5e-5;
  const auto field = filled(Vec3::Constant(0.07), 0.002, [&](const Vec3& p) { return p.norm() - ball_m; });
  const double height = ball_m + finger_m - deep_m;
  const std::vector<PlacedCapsule> start = {{Vec3(-0.02, 0, height), Vec3(0.02, 0, height), finger_m},
                                            {Vec3(-0.02, 0, -0.05), Vec3(0.02, 0, -0.05), finger_m}};
  const BackedOff back = backed_off(field, start, gap_m);
  // The trilinear field of a ball errs by less than h^2 / (4 r) = 0.03 mm.
  EXPECT_NEAR(back.largest_m, deep_m + gap_m, 5e-5);
  EXPECT_NEAR(back.capsules_O[0].a.z(), height + deep_m + gap_m, 5e-5);
  EXPECT_EQ(back.capsules_O[0].radius_m, finger_m);
  EXPECT_EQ(back.capsules_O[1].a, start[1].a);
}

// Pressed from two sides, a capsule can't move out of the way: it gets thinner by what is left.
TEST(Cage, a_finger_pressed_from_two_sides_gets_thinner) {
  const double half_gap = 0.009, finger_m = 0.01;  // a slot of 18 mm between two slabs
  const auto field =
      filled(Vec3::Constant(0.05), 0.002, [&](const Vec3& p) { return half_gap - std::abs(p.z()); });
  const BackedOff back = backed_off(field, {{Vec3(-0.01, 0, 3e-4), Vec3(0.01, 0, 3e-4), finger_m}});
  EXPECT_LE(back.capsules_O[0].radius_m, half_gap + 1e-4);
  EXPECT_GT(back.capsules_O[0].radius_m, half_gap - 1e-3);
}

// Recorded or not, a trial tells the same; its frames are evenly spaced and end with the trial.
TEST(Cage, a_recording_shows_the_trial_and_does_not_change_it) {
  const CageProtocol protocol;
  Recording recording;
  recording.see(0, "start", Pose::Identity(), Pose::Identity(), Eigen::VectorXd(0));
  const CageTrial seen = pull_trial(protocol, ring(), around_ring(false), Vec3::UnitZ(), 0, &recording);
  const CageTrial unseen = pull_trial(protocol, ring(), around_ring(false), Vec3::UnitZ(), 0);
  EXPECT_EQ(seen.ended_s, unseen.ended_s);
  EXPECT_EQ(seen.max_displacement_m, unseen.max_displacement_m);
  ASSERT_GT(recording.frames.size(), 5u);
  for (std::size_t i = 1; i + 1 < recording.frames.size(); ++i) {
    const double step = recording.frames[i].time_s - recording.frames[i - 1].time_s;
    EXPECT_GE(step, recording.every_s - 1e-9);
    EXPECT_LT(step, recording.every_s + protocol.engine.dt_s);
  }
  EXPECT_EQ(recording.frames.back().time_s, seen.ended_s);
  EXPECT_GT(recording.frames.back().X_WO.translation().z(), 0.06);  // past the end of the bar
}

TEST(Cage, same_seed_same_numbers_other_seed_others) {
  const CageProtocol protocol;
  const auto run = [&](std::uint64_t seed) {
    return wrench_trial(protocol, ring(), around_ring(true), 2, seed);
  };
  EXPECT_EQ(run(7).max_displacement_m, run(7).max_displacement_m);
  EXPECT_NE(run(7).max_displacement_m, run(8).max_displacement_m);
}

TEST(Escape, knows_inside_beside_and_gone) {
  const EscapeTest escape = around_ring(false);
  EXPECT_FALSE(escape.gone(Pose::Identity()));
  EXPECT_TRUE(escape.straight_way_out(Pose::Identity()));  // along the bar
  EXPECT_FALSE(around_ring(true).straight_way_out(Pose::Identity()));
  EXPECT_TRUE(escape.gone(Pose(Eigen::Translation3d(0.3, 0, 0))));
  EXPECT_TRUE(escape.beside(Pose(Eigen::Translation3d(0.04, 0, 0))));
  EXPECT_FALSE(escape.beside(Pose::Identity()));
}

// The search finds the open end of the bar, whose way out is a straight line and needs no random pose; from
// the bar with end stops there is none, and the search never claims one.
TEST(Escape, search_finds_the_open_end_and_no_other) {
  const EscapeSearch out = search_escape(ring_field(), around_ring(false), {}, 0);
  ASSERT_EQ(out.result, EscapeSearch::Result::found);
  EXPECT_TRUE(around_ring(false).gone(out.path_WO.back()) || around_ring(false).beside(out.path_WO.back()));
  EXPECT_LE(out.deepest_m, EscapeSearchRule{}.tolerance_m);
  EXPECT_TRUE(out.path_WO.front().isApprox(Pose::Identity(), 1e-12));
  const EscapeSearch caged = search_escape(ring_field(), around_ring(true), {.samples = 1000}, 0);
  EXPECT_EQ(caged.result, EscapeSearch::Result::not_found);
  EXPECT_GE(caged.samples, 1000);
}

TEST(Escape, search_is_the_same_for_the_same_seed) {
  const auto once = search_escape(ring_field(), around_ring(false), {}, 3);
  const auto again = search_escape(ring_field(), around_ring(false), {}, 3);
  ASSERT_EQ(once.path_WO.size(), again.path_WO.size());
  for (std::size_t i = 0; i < once.path_WO.size(); ++i)
    EXPECT_EQ(once.path_WO[i].matrix(), again.path_WO[i].matrix());
}

}  // namespace
}  // namespace geocage::physics
