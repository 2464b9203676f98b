#include "hands/force_closure.h"

#include <numbers>
#include <random>

#include <gtest/gtest.h>

namespace geocage::hands {
namespace {

double uniform(std::mt19937_64& engine, double low, double high) {
  return low + (high - low) * (static_cast<double>(engine() >> 11) * 0x1p-53);
}

/// Contacts on a sphere of radius 1 at `places`, normals outward.
std::vector<Contact> on_sphere(const std::vector<Vec3>& places) {
  std::vector<Contact> contacts;
  for (const Vec3& p : places) contacts.push_back({.p_O = p.normalized(), .n_O = p.normalized()});
  return contacts;
}

std::vector<Contact> octahedron() {
  return on_sphere(
      {Vec3::UnitX(), -Vec3::UnitX(), Vec3::UnitY(), -Vec3::UnitY(), Vec3::UnitZ(), -Vec3::UnitZ()});
}
std::vector<Contact> tetrahedron() {
  return on_sphere({Vec3(1, 1, 1), Vec3(1, -1, -1), Vec3(-1, 1, -1), Vec3(-1, -1, 1)});
}

/// Pushes along each axis, both ways, at both ends of a lever of length 1: the wrench hull is the free sum of
/// three squares with half side 1.
std::vector<Contact> levers() {
  std::vector<Contact> contacts;
  for (int axis = 0; axis < 3; ++axis)
    for (double side : {-1.0, 1.0})
      for (double way : {-1.0, 1.0})
        contacts.push_back({.p_O = side * Vec3::Unit((axis + 1) % 3), .n_O = way * Vec3::Unit(axis)});
  return contacts;
}

TEST(ForceClosure, FrictionlessForcesHaveClosedForms) {
  const auto six = force_closure(octahedron(), {.mu = 0}, WrenchPart::force);
  EXPECT_EQ(six.outcome, Resistance::force_closure);
  EXPECT_NEAR(six.low, 1 / std::sqrt(3.0), 1e-12) << "inradius of the octahedron";
  EXPECT_EQ(six.low, six.high);
  EXPECT_NEAR(six.volume, 4.0 / 3, 1e-12);
  const auto four = force_closure(tetrahedron(), {.mu = 0}, WrenchPart::force);
  EXPECT_NEAR(four.low, 1.0 / 3, 1e-12) << "inradius of the regular tetrahedron of circumradius 1";
}

TEST(ForceClosure, FrictionlessWrenchesOfLeversHaveAClosedForm) {
  // Support function of the free sum of three squares: the largest of |d_k|_1 over the three planes. Least on
  // the unit sphere where all |d_k|_2 are 1/sqrt 3, along axes. Volume of a free sum: (2! 2! 2! / 6!) 4^3.
  const auto closure = force_closure(levers(), {.mu = 0});
  EXPECT_EQ(closure.outcome, Resistance::force_closure);
  EXPECT_NEAR(closure.low, 1 / std::sqrt(3.0), 1e-12);
  EXPECT_NEAR(closure.volume, 8.0 / 720 * 64, 1e-12);
}

TEST(ForceClosure, SaysWhyNot) {
  EXPECT_EQ(force_closure({}, {}).outcome, Resistance::no_contact);
  // No torque about the centre of a sphere without friction.
  const auto sphere = force_closure(octahedron(), {.mu = 0});
  EXPECT_EQ(sphere.outcome, Resistance::rank_deficient);
  EXPECT_EQ(sphere.low, 0);
  EXPECT_EQ(sphere.high, 0);
  const auto antipodal = on_sphere({Vec3::UnitX(), -Vec3::UnitX()});
  EXPECT_EQ(force_closure(antipodal, {.mu = 0}, WrenchPart::force).outcome, Resistance::rank_deficient);
  EXPECT_EQ(force_closure(antipodal, {.mu = 0.6}).outcome, Resistance::rank_deficient)
      << "two hard points can't turn the object about their line";
  auto one_side = on_sphere({Vec3(0.3, 0, 1), Vec3(-0.3, 0.2, 1), Vec3(0, -0.3, 1)});
  const auto pushed = force_closure(one_side, {.mu = 0.3});
  EXPECT_EQ(pushed.outcome, Resistance::one_sided);
  EXPECT_EQ(pushed.low, 0);
  EXPECT_EQ(pushed.volume, 0);
  EXPECT_EQ(name_of(pushed.outcome), "one-sided");
}

// Two soft contacts at +-x, rho = 1. With a = (F_y, F_z) and b = (T_z, -T_y) their support functions are
// -F_x + mu sqrt(|a+b|^2 + (e T_x)^2) and F_x + mu sqrt(|a-b|^2 + (e T_x)^2). The larger one is least on the
// unit sphere along T_x, mu e, or at a = b, F_x = mu |a| = mu / sqrt(2 + mu^2): a pull that one contact alone
// resists.
TEST(ForceClosure, TwoSoftFingersThatFaceEachOtherCloseByForce) {
  const auto antipodal = on_sphere({Vec3::UnitX(), -Vec3::UnitX()});
  for (double e : {0.1, 0.4, 1.0}) {
    const FrictionModel model{.mu = 0.5, .edges = 12, .torsion_m = e};
    const auto closure = force_closure(antipodal, model);
    EXPECT_EQ(closure.outcome, Resistance::force_closure) << e;
    const double exact = model.mu * std::min(e, 1 / std::sqrt(2 + model.mu * model.mu));
    EXPECT_LE(closure.low, exact + 1e-12);
    EXPECT_GE(closure.high, exact - 1e-12);
    EXPECT_LT(closure.high, 1.13 * closure.low) << "faces at 22.5 and 15 degrees: 1 / (cos cos) = 1.12";
  }
  const auto parted = on_sphere({Vec3(1, 0.9, 0), Vec3(-1, 0.9, 0)});
  EXPECT_EQ(force_closure(parted, {.mu = 0.5, .torsion_m = 0.4}).outcome, Resistance::one_sided)
      << "84 degrees between them, and cones of 27";
}

TEST(ForceClosure, TheIntervalHoldsFinerConesAndShrinks) {
  const auto at = [](int edges) { return force_closure(tetrahedron(), {.mu = 0.6, .edges = edges}); };
  const auto coarse = at(8), fine = at(16);
  EXPECT_EQ(coarse.outcome, Resistance::force_closure);
  EXPECT_GT(coarse.low, 0.05);
  EXPECT_LE(coarse.low, fine.low + 1e-12) << "16 edges include the 8";
  EXPECT_GE(coarse.high, fine.low) << "the round cone lies between";
  EXPECT_GE(fine.high, fine.low);
  // The pyramids differ by 1 / cos(pi / l) - 1, a quarter at twice the edges; a third leaves room for their
  // turn.
  EXPECT_LT(fine.high - fine.low, (coarse.high - coarse.low) / 3);
}

TEST(ForceClosure, AgreesWithTheSupportFunction) {
  // eps = min over unit d of max_ij w_ij . d: samples bound it from above, and a walk down from the best
  // sample comes near it. Wrenches are built here again, with other tangents: the polygon's turn matters less
  // than Q+ - Q-.
  std::mt19937_64 engine(4);
  int closed = 0;
  for (int trial = 0; trial < 6; ++trial) {
    std::vector<Vec3> places;
    for (int i = 0; i < 5; ++i)
      places.emplace_back(uniform(engine, -1, 1), uniform(engine, -1, 1), uniform(engine, -1, 1));
    const auto contacts = on_sphere(places);
    const FrictionModel model{.mu = 0.8, .edges = 8, .center_O = Vec3(0.1, 0, 0.05), .torque_length_m = 1.1};
    const auto closure = force_closure(contacts, model);
    const auto support = [&](const Eigen::Vector<double, 6>& d) {
      double most = 0;  // the round cone: n . g + mu |tangential part of g|, g = F + (p - c) x ... transposed
      for (const Contact& contact : contacts) {
        const Vec3 g = d.head<3>() + d.tail<3>().cross(contact.p_O - model.center_O) / model.torque_length_m;
        const double along = -contact.n_O.dot(g);
        most = std::max(most, along + model.mu * (g + along * contact.n_O).norm());
      }
      return most;
    };
    double least = 1e9;
    Eigen::Vector<double, 6> best = Eigen::Vector<double, 6>::UnitX();
    for (int round = 0; round < 150; ++round) {
      const double reach = round < 10 ? 2.0 : std::pow(0.95, round - 10);
      const auto from = best;
      for (int k = 0; k < 400; ++k) {
        Eigen::Vector<double, 6> d;
        for (double& x : d) x = uniform(engine, -1, 1);
        d = (round < 10 ? d : Eigen::Vector<double, 6>(from + reach * d)).normalized();
        if (support(d) < least) least = support(d), best = d;
      }
    }
    if (closure.outcome != Resistance::force_closure) {
      EXPECT_LT(least, 0.08) << "no clear margin where the pyramids see none";
      continue;
    }
    ++closed;
    EXPECT_GE(least, closure.low - 1e-9) << "nothing resists less than Q-";
    EXPECT_LE(least, closure.high * 1.05 + 5e-3)
        << "the walk ends within 5 % or 0.005 of the worst direction";
  }
  EXPECT_GT(closed, 2);
}

TEST(ForceClosure, KeepsUnderRigidMotionAndScale) {
  const geometry::Pose motion =
      Eigen::Translation3d(0.3, -2, 1) * Eigen::AngleAxisd(1.1, Vec3(1, 2, -1).normalized());
  const auto before = force_closure(levers(), {.mu = 0.4, .edges = 16});
  auto moved = levers();
  for (Contact& contact : moved) {
    contact.p_O = 0.05 * (motion * contact.p_O);
    contact.n_O = motion.linear() * contact.n_O;
  }
  const auto after = force_closure(
      moved, {.mu = 0.4, .edges = 16, .center_O = 0.05 * motion.translation(), .torque_length_m = 0.05});
  // The pyramids' edges turn about their normals: values move inside [low, high] of both.
  EXPECT_LE(after.low, before.high + 1e-9);
  EXPECT_LE(before.low, after.high + 1e-9);
  EXPECT_NEAR(after.low, before.low, before.high - before.low);
  const auto still =
      force_closure(moved, {.mu = 0, .center_O = 0.05 * motion.translation(), .torque_length_m = 0.05});
  EXPECT_NEAR(still.low, 1 / std::sqrt(3.0), 1e-12);
}

}  // namespace
}  // namespace geocage::hands
