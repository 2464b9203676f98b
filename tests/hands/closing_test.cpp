#include "hands/closing.h"

#include <numbers>
#include <random>

#include <gtest/gtest.h>

#include "tests/hands/analytic_field.h"

namespace geocage::hands {
namespace {

using geometry::SignedDistanceField;
using tests::sampled_field;

constexpr double touch_m = 0.0002, step_rad = 0.01,
                 finger_m = 0.169;  // finger_m: reach of a finger and its radius

double uniform(std::mt19937_64& engine, double low, double high) {
  return low + (high - low) * (static_cast<double>(engine() >> 11) * 0x1p-53);
}

SignedDistanceField sphere(const Vec3& center, double radius) {
  return sampled_field([=](const Vec3& p) { return (p - center).norm() - radius; }, Vec3(-0.1, -0.1, 0.05),
                       Vec3(0.1, 0.1, 0.3), 0.002);
}

/// Open, spread so that the three fingers are symmetric about z.
Eigen::VectorXd symmetric(const Hand& hand) {
  Eigen::VectorXd q = hand.open_rad;
  q[hand.tree.dof("knuckle")] = std::numbers::pi / 3;
  return q;
}

double distance_to_segment(const Eigen::Vector2d& p, const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  const double t = std::clamp((p - a).dot(b - a) / (b - a).squaredNorm(), 0.0, 1.0);
  return (p - a - t * (b - a)).norm();
}

TEST(CapsuleDistance, AgreesWithTheClosedFormAtASphere) {
  const Vec3 center(0.01, -0.02, 0.17);
  const double radius = 0.04;
  const auto field = sphere(center, radius);
  std::mt19937_64 engine(1);
  for (int trial = 0; trial < 2000; ++trial) {
    const auto point = [&] {
      return Vec3(uniform(engine, -0.09, 0.09), uniform(engine, -0.09, 0.09), uniform(engine, 0.06, 0.29));
    };
    const PlacedCapsule capsule{point(), point(), 0.01};
    const Vec3 d = capsule.b - capsule.a;
    const double t = std::clamp((center - capsule.a).dot(d) / d.squaredNorm(), 0.0, 1.0);
    const Vec3 from_center = capsule.a + t * d - center;
    if (from_center.norm() < 0.01) continue;  // the field's own kink: its gradient has no meaning there
    const CapsuleDistance found = capsule_distance(field, capsule);
    // Trilinear error of a distance function at 1 cm from its centre: 3 h^2 / 8 R = 0.15 mm.
    EXPECT_NEAR(found.distance_m, from_center.norm() - radius - 0.01, 2e-4);
    EXPECT_NEAR((found.p_O - center).norm(), from_center.norm(), 2e-4) << "the axis point is as near";
  }
}

TEST(CapsuleGap, AgreesWithDenseSamplingAndKnownCases) {
  std::mt19937_64 engine(2);
  for (int trial = 0; trial < 300; ++trial) {
    const auto point = [&] {
      return Vec3(uniform(engine, -1, 1), uniform(engine, -1, 1), uniform(engine, -1, 1));
    };
    const PlacedCapsule a{point(), point(), 0.1}, b{point(), trial % 10 ? point() : Vec3(a.b + a.a), 0.2};
    double nearest = 1e9;
    for (int i = 0; i <= 200; ++i)
      for (int j = 0; j <= 200; ++j)
        nearest = std::min(nearest, (a.a + i / 200.0 * (a.b - a.a) - b.a - j / 200.0 * (b.b - b.a)).norm());
    const double gap = capsule_gap_m(a, b);
    EXPECT_LE(gap, nearest - 0.3 + 1e-12);
    EXPECT_GE(gap, nearest - 0.3 - 0.02)
        << "samples lie at most 3.5 / 400 from the nearest points of each segment";
  }
  const PlacedCapsule x{{0, 0, 0}, {1, 0, 0}, 0.1}, parallel{{0.5, 1, 0}, {2, 1, 0}, 0.1},
      point{{2, 0, 0}, {2, 0, 0}, 0};
  EXPECT_DOUBLE_EQ(capsule_gap_m(x, parallel), 0.8);
  EXPECT_DOUBLE_EQ(capsule_gap_m(x, point), 0.9);
  EXPECT_DOUBLE_EQ(capsule_gap_m(point, point), 0);
  EXPECT_DOUBLE_EQ(capsule_gap_m(x, x), -0.2);
}

TEST(CloseHand, TouchesASphereWithAllFingersAlike) {
  const Hand hand = load_hand("schunk_sdh");
  const double radius = 0.04, height = 0.17;
  const auto field = sphere(Vec3(0, 0, height), radius);
  const ClosedHand closed = close_hand(hand, field, Pose::Identity(), symmetric(hand), {});
  ASSERT_EQ(closed.outcome, Closure::closed);
  EXPECT_EQ(closed.fingers_touching, 3);
  ASSERT_EQ(closed.contacts.size(), 6u) << "proximal links first, then the distal ones bend on";

  // The proximal angle in the finger's plane: a straight finger from (38.1 mm, 91 mm) leans inwards until one
  // of its capsules is within the radii of the sphere's centre (0, height). Bisection of the gap.
  const Eigen::Vector2d base(0.0381, 0.091), center(0, height);
  const auto gap = [&](double angle) {
    const Eigen::Vector2d along(-std::sin(angle), std::cos(angle)), knee = base + 0.0865 * along;
    return std::min(distance_to_segment(center, base, knee) - 0.014,
                    distance_to_segment(center, knee, knee + 0.055 * along) - 0.0135) -
           radius;
  };
  double open = -0.8, shut = 0.8;
  for (int i = 0; i < 60; ++i) (gap(0.5 * (open + shut)) > 0 ? open : shut) = 0.5 * (open + shut);
  for (const char* joint : {"finger_12", "finger_22", "thumb_2"}) {
    // It stops within touch_m of the sphere; a touch at the lever of the contact (>= 60 mm) is 3.4 mrad.
    EXPECT_LE(closed.q[hand.tree.dof(joint)], open + 1e-3) << "field error 0.03 mm at 60 mm";
    EXPECT_GE(closed.q[hand.tree.dof(joint)], open - touch_m / 0.06 - 1e-3);
  }
  for (std::size_t i = 0; i < 6; ++i) {
    const Contact& contact = closed.contacts[i];
    EXPECT_NEAR((contact.p_O - Vec3(0, 0, height)).norm(), radius, 1e-4) << "on the surface";
    EXPECT_GT(contact.n_O.dot((contact.p_O - Vec3(0, 0, height)).normalized()), 0.999) << "outward";
    EXPECT_NEAR(contact.p_O.z(), closed.contacts[i % 2].p_O.z(), 1e-3) << "like the first finger's";
  }
}

TEST(CloseHand, WrapsACylinderAlongTheFlexionAxis) {
  const Hand hand = load_hand("schunk_sdh");
  const double radius = 0.03;
  const Vec3 center(-0.0095, 0, 0.155);  // midway between the thumb and the two fingers
  const auto field = sampled_field(
      [=](const Vec3& p) { return std::hypot(p.x() - center.x(), p.z() - center.z()) - radius; },
      Vec3(-0.1, -0.15, 0.05), Vec3(0.1, 0.15, 0.3), 0.002);
  const ClosedHand closed = close_hand(hand, field, Pose::Identity(), hand.open_rad, {});
  EXPECT_EQ(closed.fingers_touching, 3);
  EXPECT_LE(closed.penetration_m, 0.0005);
  const auto angle = [&](const char* joint) { return closed.q[hand.tree.dof(joint)]; };
  EXPECT_NEAR(angle("finger_12"), angle("finger_22"), 1e-9) << "mirrored fingers";
  EXPECT_NEAR(angle("finger_13"), angle("finger_23"), 1e-9);
  EXPECT_NEAR(angle("finger_12"), angle("thumb_2"), 1e-3 + touch_m / 0.06)
      << "mirrored in the cylinder's plane";
  EXPECT_GT(angle("finger_13"), 0.1) << "the distal links bend on after the proximal ones touch";
}

TEST(CloseHand, DoesNotTunnelThroughAThinWall) {
  const Hand hand = load_hand("schunk_sdh");
  const Vec3 half(0.0015, 0.05, 0.06);
  const Vec3 center(-0.0095, 0, 0.2);
  const auto field = sampled_field([=](const Vec3& p) { return tests::box_distance(p - center, half); },
                                   Vec3(-0.05, -0.09, 0.1), Vec3(0.03, 0.09, 0.3), 0.00075);
  const ClosedHand closed = close_hand(hand, field, Pose::Identity(), hand.open_rad, {});
  EXPECT_EQ(closed.fingers_touching, 3);
  EXPECT_LE(closed.penetration_m, 0.001);
  const auto placed = placed_capsules(hand, Pose::Identity(), closed.q);
  for (std::size_t i = 0; i < placed.size(); ++i) {
    const std::string& link = hand.tree.links[hand.capsules[i].link];
    if (link == "palm" || link.back() == '1') continue;
    const double side = link.starts_with("thumb") ? -1 : 1;
    EXPECT_GT(side * (placed[i].b.x() - center.x()), 0) << link;
  }
}

TEST(CloseHand, SaysWhenTheOpenHandIsInside) {
  const Hand hand = load_hand("schunk_sdh");
  const ClosedHand closed =
      close_hand(hand, sphere(Vec3(0, 0, 0.1), 0.04), Pose::Identity(), hand.open_rad, {});
  EXPECT_EQ(closed.outcome, Closure::blocked_at_start);
  EXPECT_EQ(closed.q, hand.open_rad);
  EXPECT_NEAR(closed.penetration_m, 0.1 + 0.04 - 0.14, 0.08) << "some tens of millimetres";
  EXPECT_GT(closed.penetration_m, 0.02) << "the palm's top is 26 mm inside the sphere";
}

TEST(CloseHand, StopsAtItsLimitsOrItselfWhenThereIsNothing) {
  const Hand hand = load_hand("schunk_sdh");
  const auto far = sphere(Vec3(0.5, 0.5, 0.5), 0.01);
  std::mt19937_64 engine(4);
  for (int trial = 0; trial < 20; ++trial) {
    Eigen::VectorXd q = hand.open_rad;
    q[hand.tree.dof("knuckle")] = uniform(engine, 0, 1.2);
    const ClosedHand closed = close_hand(hand, far, Pose::Identity(), q, {});
    EXPECT_TRUE(closed.contacts.empty());
    EXPECT_EQ(closed.fingers_touching, 0);
    EXPECT_TRUE(((hand.tree.upper_rad - closed.q).array() >= -1e-12).all());
    const auto placed = placed_capsules(hand, Pose::Identity(), closed.q);
    for (std::size_t i = 0; i < placed.size(); ++i)
      for (std::size_t j = 0; j < i; ++j) {
        const int a = hand.capsules[i].link, b = hand.capsules[j].link;
        const auto neighbours = [&](int child, int parent) {
          return child != 0 && hand.tree.joints[child - 1].parent_link == parent;
        };
        if (a == b || neighbours(a, b) || neighbours(b, a)) continue;
        EXPECT_GT(capsule_gap_m(placed[i], placed[j]), 0)
            << hand.tree.links[a] << " and " << hand.tree.links[b];
      }
  }
}

TEST(CloseHand, GoesOneWayInsideItsLimitsInEveryOrder) {
  const Hand hand = load_hand("schunk_sdh");
  const auto field = sphere(Vec3(0.01, 0.005, 0.17), 0.03);
  for (const ClosingOrder order :
       {ClosingOrder::proximal_first, ClosingOrder::together, ClosingOrder::breakaway}) {
    ClosingRule rule;
    rule.order = order;
    std::vector<Eigen::VectorXd> path;
    const ClosedHand closed = close_hand(hand, field, Pose::Identity(), hand.open_rad, rule, &path);
    ASSERT_GT(path.size(), 10u);
    EXPECT_EQ(path.front(), hand.open_rad);
    EXPECT_EQ(path.back(), closed.q);
    EXPECT_EQ(closed.fingers_touching, 3);
    EXPECT_LE(closed.penetration_m, 0.0005);
    const int proximal = hand.tree.dof("thumb_2"), distal = hand.tree.dof("thumb_3");
    bool distal_moves_first = false;
    for (std::size_t i = 1; i < path.size(); ++i) {
      const Eigen::VectorXd move = path[i] - path[i - 1];
      EXPECT_GE(move.cwiseProduct(hand.closing_rad).minCoeff(), 0) << "monotone";
      EXPECT_LE(move.cwiseAbs().maxCoeff(), rule.step_rad + 1e-12);
      EXPECT_GE((hand.tree.upper_rad - path[i]).minCoeff(), -1e-12);
      distal_moves_first |=
          path[i][distal] > hand.open_rad[distal] && path[i][proximal] < closed.q[proximal] - 0.05;
      if (order == ClosingOrder::breakaway && closed.q[proximal] - path[i][proximal] > 1e-9) {
        EXPECT_NEAR(path[i][distal] - hand.open_rad[distal], path[i][proximal] - hand.open_rad[proximal],
                    1e-9)
            << "one proportion until the proximal joint is stopped";
      }
    }
    EXPECT_EQ(distal_moves_first, order != ClosingOrder::proximal_first);
  }
}

TEST(CloseHand, NeverPenetratesAnywhere) {
  const Hand hand = load_hand("schunk_sdh");
  const auto torus =
      sampled_field([](const Vec3& p) { return std::hypot(std::hypot(p.x(), p.y()) - 0.045, p.z()) - 0.012; },
                    Vec3(-0.09, -0.09, -0.04), Vec3(0.09, 0.09, 0.04), 0.0015);
  std::mt19937_64 engine(5);
  int closings = 0;
  for (int trial = 0; trial < 400; ++trial) {
    Pose X_OH = Pose::Identity();
    X_OH.linear() = Eigen::Quaterniond(Eigen::Vector4d(uniform(engine, -1, 1), uniform(engine, -1, 1),
                                                       uniform(engine, -1, 1), uniform(engine, -1, 1))
                                           .normalized())
                        .toRotationMatrix();
    X_OH.translation() = -X_OH.linear() * Vec3(uniform(engine, -0.03, 0.03), uniform(engine, -0.03, 0.03),
                                               uniform(engine, 0.11, 0.2));
    const ClosedHand closed = close_hand(hand, torus, X_OH, hand.open_rad, {});
    if (closed.outcome == Closure::blocked_at_start) continue;
    ++closings;
    EXPECT_LE(closed.penetration_m, 0.001) << "trial " << trial;
    for (const Contact& contact : closed.contacts)
      EXPECT_NEAR(torus.value(contact.p_O), 0, 5e-4) << "trial " << trial;
  }
  EXPECT_GT(closings, 100);
}

}  // namespace
}  // namespace geocage::hands
