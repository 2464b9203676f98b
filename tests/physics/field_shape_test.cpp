#include "physics/field_shape.h"

#include <algorithm>
#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "tests/physics/scenes.h"

namespace geocage::physics {
namespace {

constexpr double cell_m = 0.002, contact_m = 1e-3;

// Interpolating a distance of curvature 1/d errs by at most 2 h^2 / (8 d): 0.03 mm here, and normals by about
// h^2/d^2.
TEST(FieldContacts, of_a_sphere_lie_where_the_axis_is_nearest) {
  const double R = 0.03, r = 0.012;
  const auto field = filled(Vec3::Constant(0.07), cell_m, [&](const Vec3& p) { return p.norm() - R; });
  const Vec3 nearest = (R + r + 0.5e-3) * Vec3(1, 2, 2) / 3, along = Vec3(2, -2, 1) / 3;  // orthogonal
  const FieldContacts found =
      field_contacts(field, {nearest - 0.017 * along, nearest + 0.03 * along, r}, contact_m);
  ASSERT_GE(found.size, 1);
  const auto& deepest = *std::min_element(found.items.begin(), found.items.begin() + found.size,
                                          [](auto& a, auto& b) { return a.value_m < b.value_m; });
  EXPECT_NEAR(deepest.value_m - r, 0.5e-3, 3e-5);
  EXPECT_LT((deepest.n_O - nearest.normalized()).norm(), 0.01);
  EXPECT_LT((deepest.p_O - nearest).norm(), 0.5e-3);
  EXPECT_EQ(field_contacts(field, {1.05 * nearest, 1.05 * nearest, r}, contact_m).size, 0);
}

// On a flat face a capsule needs two contacts as far apart as the face allows, or the body rocks.
TEST(FieldContacts, of_a_flat_face_reach_to_its_edges) {
  const Vec3 half(0.04, 0.04, 0.02);
  const auto field =
      filled(Vec3(0.08, 0.08, 0.06), cell_m, [&](const Vec3& p) { return box_distance(p, half); });
  const double r = 0.01, height = half.z() + r + 2e-4;
  const FieldContacts found =
      field_contacts(field, {Vec3(-0.2, 0, height), Vec3(0.2, 0, height), r}, contact_m);
  double low = 0, high = 0;
  for (int i = 0; i < found.size; ++i) {
    low = std::min(low, found.items[i].p_O.x()), high = std::max(high, found.items[i].p_O.x());
    EXPECT_NEAR(found.items[i].value_m - r, 2e-4, 6e-5);  // 0.05 mm shares the load
    EXPECT_LT((found.items[i].n_O - Vec3::UnitZ()).norm(), 1e-6);
  }
  EXPECT_LT(low, -half.x() + 0.0045);  // within one sample of the edge
  EXPECT_GT(high, half.x() - 0.0045);
}

// A finger along a groove of two walls at a right angle meets both, each with its own normal and gap, and
// gets no bisector between them. The field is linear on either side of the crease, so slopes and gaps are
// exact but for single precision.
TEST(FieldContacts, of_a_groove_are_its_two_walls) {
  const auto field = filled(Vec3::Constant(0.04), 0.002, [](const Vec3& p) {
    return std::min(p.z() - p.x(), p.z() + p.x()) / std::sqrt(2.0);
  });
  const double r = 0.01, gap = 3e-4, height = std::sqrt(2.0) * (r + gap);
  const FieldContacts found =
      field_contacts(field, {Vec3(0, -0.0015, height), Vec3(0, 0.0015, height), r}, contact_m);
  ASSERT_GE(found.size, 2);
  bool left = false, right = false;
  for (int i = 0; i < found.size; ++i) {
    const FieldContact& contact = found.items[i];
    EXPECT_NEAR(contact.value_m - r, gap, 1e-6);
    left |= (contact.n_O - Vec3(1, 0, 1).normalized()).norm() < 1e-3;
    right |= (contact.n_O - Vec3(-1, 0, 1).normalized()).norm() < 1e-3;
  }
  EXPECT_TRUE(left && right);
}

// A fingertip in the corner of three walls, whichever way it points: the deepest contact is as deep as the
// field says at the nearest place of its axis, no less and no more, but for what shares a load (0.05 mm) and
// a sample's refinement (1 % of 8 mm).
TEST(FieldContacts, of_a_tip_in_a_corner_tell_the_depth_of_the_nearest_wall) {
  const auto field = filled(Vec3::Constant(0.06), 0.002, [](const Vec3& p) { return p.minCoeff(); });
  const double r = 0.01;
  std::mt19937_64 random(5);
  std::uniform_real_distribution<> unit(0, 1);
  for (int i = 0; i < 500; ++i) {
    const Vec3 tip =
        Vec3::Constant(r) + 1e-3 * Vec3(unit(random), unit(random), unit(random)) - Vec3::Constant(1e-3);
    const Vec3 away = Vec3(unit(random), unit(random), unit(random)).normalized();
    const FieldContacts found = field_contacts(field, {tip + 0.03 * away, tip, r}, contact_m);
    double deepest = 1, nearest = 1;
    for (int c = 0; c < found.size; ++c) deepest = std::min(deepest, found.items[c].value_m);
    for (double at = 0; at <= 0.03; at += 1e-5) nearest = std::min(nearest, field.value(tip + at * away));
    EXPECT_NEAR(deepest, nearest, 1.3e-4) << tip.transpose() << " along " << away.transpose();
  }
}

// A finger across a hollow rests on both rims, though one is 0.2 mm deeper than the other: two balls, a
// capsule over both, and every place of the axis within reach.
TEST(FieldContacts, of_a_hollow_are_all_its_rims) {
  const double R = 0.02, r = 0.01, apart = 0.006, lower = 2e-4;
  const auto field = filled(Vec3::Constant(0.045), 0.0015, [&](const Vec3& p) {
    return std::min((p - Vec3(-apart, 0, 0)).norm(), (p - Vec3(apart, 0, -lower)).norm()) - R;
  });
  const double height = R + r + 1e-4;
  const FieldContacts found =
      field_contacts(field, {Vec3(-0.012, 0, height), Vec3(0.012, 0, height), r}, contact_m);
  bool left = false, right = false;
  for (int i = 0; i < found.size; ++i) {
    // A sample of 4 mm is refined to 1 % of 8 mm; the field errs by h^2 / (4 d) = 0.02 mm.
    left |=
        std::abs(found.items[i].p_O.x() + apart) < 5e-4 && std::abs(found.items[i].value_m - r - 1e-4) < 5e-5;
    right |=
        std::abs(found.items[i].p_O.x() - apart) < 5e-4 && std::abs(found.items[i].value_m - r - 3e-4) < 5e-5;
  }
  EXPECT_TRUE(left && right);
}

// A ring keeps its hole: a capsule through it touches nothing, one through the tube does.
TEST(FieldContacts, leave_a_hole_open) {
  const auto field =
      filled(Vec3(0.09, 0.09, 0.04), cell_m, [](const Vec3& p) { return torus_distance(p, 0.05, 0.008); });
  const Vec3 up(0, 0, 0.03);
  EXPECT_EQ(field_contacts(field, {-up, up, 0.03}, contact_m).size, 0);
  EXPECT_GT(field_contacts(field, {-up, up, 0.042}, contact_m).size, 0);
}

// What a track remembers and a field's marks only spare lookups: along a random walk past a torus, turning,
// near and far, inside and outside the field's grid, the contacts are those of a look at every sample, to the
// bit. No interpolated slope is above sqrt(3) < 2. (38 mm are no multiple of the samples' 4 mm, whose number
// then hangs on no rounding.)
TEST(FieldContacts, of_a_tracked_capsule_are_those_of_a_new_one) {
  const auto field =
      filled(Vec3(0.08, 0.08, 0.04), cell_m, [](const Vec3& p) { return torus_distance(p, 0.04, 0.01); });
  auto plain = field;
  plain.marks.clear();
  std::mt19937 random(0);
  std::normal_distribution<double> normal;
  const auto draw = [&] { return Vec3(normal(random), normal(random), normal(random)); };
  CapsuleTrack track;
  Vec3 middle(0.04, 0, 0.03), along(1, 0, 0);
  int touching = 0;
  for (int step = 0; step < 3000; ++step) {
    middle = 0.99 * (middle + (step % 100 == 0 ? 0.01 : 0.0005) * draw());
    along = (along + 0.01 * draw()).normalized();
    const hands::PlacedCapsule capsule{middle - 0.019 * along, middle + 0.019 * along, 0.008};
    const double gap_m = contact_m * (1 + step % 2);  // a faster step makes contacts from farther away
    const FieldContacts tracked = track.contacts(field, capsule, gap_m);
    const FieldContacts fresh = field_contacts(plain, capsule, gap_m);
    ASSERT_EQ(tracked.size, fresh.size) << step;
    touching += fresh.size > 0;
    for (int i = 0; i < fresh.size; ++i) {
      EXPECT_EQ(tracked.items[i].p_O, fresh.items[i].p_O) << step;
      EXPECT_EQ(tracked.items[i].n_O, fresh.items[i].n_O) << step;
      EXPECT_EQ(tracked.items[i].value_m, fresh.items[i].value_m) << step;
    }
  }
  EXPECT_GT(touching, 300);
  EXPECT_LT(touching, 2700);
}

}  // namespace
}  // namespace geocage::physics
