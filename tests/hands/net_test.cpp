#include "hands/net.h"

#include <gtest/gtest.h>

#include "datasets/shapes.h"
#include "hands/caging.h"

namespace geocage::hands {
namespace {

constexpr double radius_m = 0.03;

/// A net over a ball, from its top.
struct Scene {
  Hand hand = load_hand("net_of_points");
  geometry::TriangleMesh mesh = datasets::icosphere(radius_m, 4);
  geometry::SignedDistanceField field =
      geometry::build_distance_field(mesh, {.cells = 40, .pad_m = 0.03, .refine = 2});
  int top = 0;

  Scene() {
    for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
      if (mesh.vertices[v].z() > mesh.vertices[top].z()) top = static_cast<int>(v);
  }
  Net net(double ball_m) { return tighten_net(hand, mesh, field, top, ball_m, -Vec3::UnitZ()); }
  double blocked(const Net& net) { return blocked_share(field, net_capsules(net)); }
};

TEST(Net, LiesOnTheBallAndKeepsItsEdges) {
  Scene scene;
  const Net net = scene.net(0.03);
  ASSERT_GT(net.points_O.size(), 50u);
  // Chord of 1/40 of the box (2.4 mm coarse, 1.2 mm fine): h^2 / 8 R = 6 um, and the mesh is inscribed by 17
  // um.
  EXPECT_LT(net.penetration_m, 5e-5);
  EXPECT_GT(net.contacts.size(), net.points_O.size() / 2) << "most of the net lies on a convex body";
  for (const Vec3& p : net.points_O) EXPECT_GT(p.norm(), radius_m + net.point_radius_m - 1e-4);
  for (const Contact& contact : net.contacts) {
    EXPECT_NEAR(contact.p_O.norm(), radius_m, 1e-4);
    EXPECT_GT(contact.n_O.dot(contact.p_O.normalized()), 0.99);
  }
  EXPECT_LE(net.stretch, scene.hand.net->stretch_share + 0.02) << "relaxed, not solved to the end";
}

TEST(Net, CagesOnceItReachesBehindTheEquator) {
  Scene scene;
  const double cap = scene.blocked(scene.net(0.02)), bag = scene.blocked(scene.net(0.085));
  EXPECT_LT(cap, 0.75) << "a cap leaves the half space below open";
  EXPECT_GT(cap, 0.2);
  EXPECT_EQ(bag, 1) << "nothing but a hole smaller than the ball is open";
}

}  // namespace
}  // namespace geocage::hands
