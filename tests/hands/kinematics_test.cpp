#include "hands/kinematics.h"

#include <numbers>
#include <random>

#include <gtest/gtest.h>

#include "hands/hand.h"
#include "pipeline/error.h"

namespace geocage::hands {
namespace {

constexpr double distal_m = 0.0685;

double uniform(std::mt19937_64& engine, double low, double high) {
  return low + (high - low) * (static_cast<double>(engine() >> 11) * 0x1p-53);
}

/// Posture by joint name; what is not named is 0.
Eigen::VectorXd posture(const KinematicTree& tree,
                        std::initializer_list<std::pair<const char*, double>> values) {
  Eigen::VectorXd q = Eigen::VectorXd::Zero(tree.dofs());
  for (const auto& [name, value] : values) q[tree.dof(name)] = value;
  return q;
}

Vec3 tip(const KinematicTree& tree, const Eigen::VectorXd& q, const char* link) {
  std::vector<Pose> X_HL;
  forward_kinematics(tree, q, X_HL);
  return X_HL[tree.link(link)] * Vec3(0, 0, distal_m);
}

/// A planar two-link finger on a base at (x, y), its plane turned by `yaw`: written by hand from the drawing.
Vec3 two_links(double x, double y, double yaw, double proximal, double distal) {
  const double out = 0.0865 * std::sin(proximal) + distal_m * std::sin(proximal + distal);
  const double up = 0.0745 + 0.0165 + 0.0865 * std::cos(proximal) + distal_m * std::cos(proximal + distal);
  return {x + out * std::cos(yaw), y + out * std::sin(yaw), up};
}

// Sums of a handful of terms below 1 m: a few rounding errors of 1e-16.
constexpr double rounding = 1e-14;

TEST(SchunkSdh, TipsFollowThePlanarTwoLinkFormula) {
  const KinematicTree tree = load_hand("schunk_sdh").tree;
  const double pi = std::numbers::pi;
  for (const auto& [spread, proximal, distal] : {std::array{0.0, 0.0, 0.0},
                                                 {0.0, -0.8, 0.0},
                                                 {0.5, 0.3, 0.9},
                                                 {1.5, -1.2, 1.5},
                                                 {pi / 3, 0.7, -0.4}}) {
    const auto q = posture(tree, {{"knuckle", spread},
                                  {"finger_12", proximal},
                                  {"finger_13", distal},
                                  {"finger_22", proximal},
                                  {"finger_23", distal},
                                  {"thumb_2", proximal},
                                  {"thumb_3", distal}});
    const auto near = [&](const char* link, const Vec3& by_hand) {
      EXPECT_LT((tip(tree, q, link) - by_hand).norm(), rounding) << link << " at spread " << spread;
    };
    near("finger_13", two_links(0.01905, 0.033, pi + spread, proximal, distal));
    near("finger_23", two_links(0.01905, -0.033, pi - spread, proximal, distal));
    near("thumb_3", two_links(-0.03811, 0, 0, proximal, distal));
  }
}

TEST(SchunkSdh, StraightReachAndBaseTriangleAreThoseOfTheDataSheet) {
  const KinematicTree tree = load_hand("schunk_sdh").tree;
  const Eigen::VectorXd straight = Eigen::VectorXd::Zero(tree.dofs());
  for (const char* link : {"finger_13", "finger_23", "thumb_3"})
    EXPECT_NEAR(tip(tree, straight, link).z(), 0.246, rounding);
  std::vector<Pose> X_HL;
  forward_kinematics(tree, straight, X_HL);
  const Vec3 a = X_HL[tree.link("finger_11")].translation(), b = X_HL[tree.link("finger_21")].translation(),
             c = X_HL[tree.link("thumb_1")].translation();
  // hands.md gives the bases to 0.01 mm, so the sides of the triangle agree to 0.01 mm.
  for (double side : {(a - b).norm(), (b - c).norm(), (c - a).norm()}) EXPECT_NEAR(side, 0.066, 1e-5);
}

TEST(SchunkSdh, HasSevenDrivesAndItsSpreadIsCoupled) {
  const KinematicTree tree = load_hand("schunk_sdh").tree;
  EXPECT_EQ(tree.dofs(), 7);
  const auto q = posture(tree, {{"knuckle", 0.4}, {"finger_12", 0.5}, {"finger_22", 0.5}});
  const Vec3 left = tip(tree, q, "finger_13"), right = tip(tree, q, "finger_23");
  EXPECT_LT((left - Vec3(right.x(), -right.y(), right.z())).norm(), rounding)
      << "mirrored in the plane y = 0";
}

TEST(PointJacobian, AgreesWithCentralDifferencesAtRandomPostures) {
  const KinematicTree tree = load_hand("schunk_sdh").tree;
  std::mt19937_64 engine(1);
  std::vector<Pose> X_HL, X_plus, X_minus;
  Eigen::Matrix3Xd jacobian(3, tree.dofs());
  // Central differences: h^2/6 of the third derivative (<= 0.2 m) = 3e-12, and rounding 1e-16/h = 1e-11.
  const double h = 1e-5, tolerance = 1e-10;
  for (int trial = 0; trial < 1000; ++trial) {
    Eigen::VectorXd q(tree.dofs());
    for (int i = 0; i < q.size(); ++i) q[i] = uniform(engine, tree.lower_rad[i], tree.upper_rad[i]);
    const int link = static_cast<int>(engine() % tree.links.size());
    const Vec3 p_L(uniform(engine, -0.1, 0.1), uniform(engine, -0.1, 0.1), uniform(engine, -0.1, 0.1));
    forward_kinematics(tree, q, X_HL);
    point_jacobian(tree, X_HL, link, X_HL[link] * p_L, jacobian);
    for (int i = 0; i < q.size(); ++i) {
      const Eigen::VectorXd step = h * Eigen::VectorXd::Unit(q.size(), i);
      forward_kinematics(tree, q + step, X_plus);
      forward_kinematics(tree, q - step, X_minus);
      const Vec3 slope = (X_plus[link] * p_L - X_minus[link] * p_L) / (2 * h);
      ASSERT_LT((jacobian.col(i) - slope).norm(), tolerance) << tree.links[link] << ", " << tree.dof_names[i];
    }
  }
}

TEST(KinematicTree, UnknownNamesAreRefusedWithTheNearest) {
  const KinematicTree tree = load_hand("schunk_sdh").tree;
  try {
    tree.dof("knukle");
    FAIL();
  } catch (const pipeline::UserError& error) {
    EXPECT_NE(std::string(error.what()).find("'knuckle'"), std::string::npos) << error.what();
  }
  EXPECT_THROW(tree.link("finger_14"), pipeline::UserError);
}

}  // namespace
}  // namespace geocage::hands
