// Derivatives of the writhe matrix, and that asking for them takes no memory.
#include <array>

#include <gtest/gtest.h>

#include "tests/allocations.h"
#include "tests/topology/curves.h"
#include "topology/writhe.h"

namespace geocage::topology {
namespace {

using Four = std::array<Vec3, 4>;

double writhe(const Four& x) {
  return segment_writhe(x[0], x[1], x[2], x[3]);
}
std::array<Vec3, 4> gradient_of(const Four& x, double most = no_cap_1pm) {
  SegmentGradient g;
  segment_writhe(x[0], x[1], x[2], x[3], g, most);
  return {g.a, g.b, g.c, g.d};
}

double distance(const Four& x) {
  double least = 1e9;
  for (int i = 0; i <= 50; ++i)
    for (int j = 0; j <= 50; ++j)
      least = std::min(least, (x[0] + i / 50.0 * (x[1] - x[0]) - x[2] - j / 50.0 * (x[3] - x[2])).norm());
  return least;
}

Four random_segments(std::mt19937_64& random, double gap) {
  for (;;) {
    const Four x = {random_point(random), random_point(random), random_point(random), random_point(random)};
    if (distance(x) > gap) return x;
  }
}

/// Derivative of the solid angle of the triangle x, y, z by x (Van Oosterom and Strackee's formula, quotient
/// rule): the second way to the same derivatives.
Vec3 triangle_gradient(const Vec3& x, const Vec3& y, const Vec3& z) {
  const double lx = x.norm(), ly = y.norm(), lz = z.norm();
  const double up = x.dot(y.cross(z)), down = lx * ly * lz + x.dot(y) * lz + y.dot(z) * lx + z.dot(x) * ly;
  const Vec3 d_up = y.cross(z), d_down = x / lx * (ly * lz + y.dot(z)) + y * lz + z * ly;
  return 2 * (down * d_up - up * d_down) / (up * up + down * down);
}

std::array<Vec3, 4> second_way(const Four& x) {
  const Vec3 p = x[2] - x[0], q = x[3] - x[0], r = x[3] - x[1], s = x[2] - x[1];
  const Vec3 dp = -triangle_gradient(p, q, r) - triangle_gradient(p, r, s), dq = -triangle_gradient(q, r, p),
             dr = -triangle_gradient(r, p, q) - triangle_gradient(r, s, p), ds = -triangle_gradient(s, p, r);
  return {-dp - dq, -dr - ds, dp + ds, dq + dr};
}

TEST(WritheGradient, GoldenValues) {
  const auto g = gradient_of({Vec3(.1, .2, 0), Vec3(1, 0, .1), Vec3(.3, -.4, .5), Vec3(.9, .8, .7)});
  EXPECT_LT((g[0] - Vec3(1.339203323, -0.772053507, -1.974479779)).norm(), 2e-9);  // printed digits
  EXPECT_LT((g[1] - Vec3(-1.264670268, 0.696277024, -2.294745921)).norm(), 2e-9);
}

// At a distance of 0.1 third derivatives are of size 1 / gap^3 = 1e3: differences of h = 1e-5 are wrong by
// 1e3 h^2 / 6 = 2e-8 and rounding adds 1e-15 / h = 1e-10.
TEST(WritheGradient, IsThatOfDifferences) {
  std::mt19937_64 random(1);
  const double h = 1e-5;
  for (int i = 0; i < 3000; ++i) {
    Four x = random_segments(random, 0.1);
    const auto g = gradient_of(x);
    for (int k = 0; k < 4; ++k)
      for (int axis = 0; axis < 3; ++axis) {
        const double at = x[k][axis];
        x[k][axis] = at + h;
        const double more = writhe(x);
        x[k][axis] = at - h;
        const double less = writhe(x);
        x[k][axis] = at;
        ASSERT_NEAR(g[k][axis], (more - less) / (2 * h), 1e-7) << i;
      }
  }
}

// Both ways round to about 1e-16 times their largest terms. The second one's grow like 1 / d where the
// diagonal of the parallelogram passes the eye at the distance d, and its terms then cancel.
TEST(WritheGradient, IsThatOfTwoTriangles) {
  std::mt19937_64 random(2);
  double worst = 0;
  for (int i = 0; i < 20000; ++i) {
    const Four x = random_segments(random, 0.02);
    const auto g = gradient_of(x), other = second_way(x);
    for (int k = 0; k < 4; ++k) worst = std::max(worst, (g[k] - other[k]).norm() / (1 + g[k].norm()));
  }
  EXPECT_LT(worst, 1e-9);
  EXPECT_GT(worst, 0);  // they are two ways
}

TEST(WritheGradient, PartsAddUpToNothing) {
  std::mt19937_64 random(3);
  for (int i = 0; i < 1000; ++i) {
    const Four x = random_segments(random, 0.05);
    const auto g = gradient_of(x);
    EXPECT_LT((g[0] + g[1] + g[2] + g[3]).norm(), 1e-11);  // moving all changes nothing
    Vec3 turn = Vec3::Zero();
    double stretch = 0;
    for (int k = 0; k < 4; ++k) {
      turn += x[k].cross(g[k]);
      stretch += x[k].dot(g[k]);
    }
    EXPECT_LT(turn.norm(), 1e-11);   // nor turning
    EXPECT_NEAR(stretch, 0, 1e-11);  // nor scaling
  }
}

// A coplanar pair has the value 0 and a slope: the cross at the height h through a point beyond an end.
TEST(WritheGradient, SegmentsInOnePlaneHaveASlope) {
  const Four x = {Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(2, -1, 0), Vec3(2.5, 3, 0)};
  const auto g = gradient_of(x);
  Four lifted = x;
  lifted[0].z() = 1e-6;
  EXPECT_EQ(writhe(x), 0);
  EXPECT_NEAR(g[0].z(), writhe(lifted) / 1e-6, 1e-6);  // second order: 1e-6
  EXPECT_GT(std::abs(g[0].z()), 0.01);
}

TEST(WritheGradient, DegenerateOnesAreFinite) {
  const Vec3 o(0, 0, 0), x(1, 0, 0), y(1, 1, 0), m(0.5, 0, 0);
  for (const Four& pair : {Four{o, x, x, y}, Four{o, x, m, y}, Four{o, x, o, x}, Four{o, x, x, o},
                           Four{o, o, o, o}, Four{o, x, m, Vec3(3, 0, 0)}}) {
    for (const Vec3& part : gradient_of(pair)) EXPECT_EQ(part, Vec3::Zero());
    EXPECT_EQ(writhe(pair), 0);
  }
  for (const Four& pair : {Four{o, x, Vec3(2, 0, 0), Vec3(3, 0, 0)}, Four{o, o, x, y}})  // in line, no length
    for (const Vec3& part : gradient_of(pair)) EXPECT_TRUE(part.allFinite());
}

// An end at the height h over the other segment: the gradient is of size 2 / h, until it meets the cap.
TEST(WritheGradient, CapKeepsDirectionAndSum) {
  for (double h : {1e-3, 1e-6, 1e-12}) {
    const Four x = {Vec3(-1, 0, 0), Vec3(1, 0, 0), Vec3(0.1, 0, h), Vec3(0.2, 0.3, 1)};
    const auto whole = gradient_of(x), capped = gradient_of(x, 50);
    EXPECT_GT(whole[2].norm(), 0.5 / h);
    double longest = 0;
    for (int k = 0; k < 4; ++k) {
      longest = std::max(longest, capped[k].norm());
      EXPECT_LT(capped[k].cross(whole[k]).norm(), 1e-12 * capped[k].norm() * whole[k].norm() + 1e-15);
    }
    EXPECT_NEAR(longest, 50, 1e-9);
    EXPECT_LT((capped[0] + capped[1] + capped[2] + capped[3]).norm(), 1e-11);
  }
}

/// A chain of joints that turn about fixed axes at their points, and the Jacobian of its points.
Polyline bent(const Eigen::VectorXd& q, Eigen::MatrixXd* jacobian = nullptr) {
  Polyline points = {Vec3(-0.4, 0.1, 0)};
  std::vector<Vec3> axes, at;
  Eigen::Matrix3d turned = Eigen::Matrix3d::Identity();
  for (int i = 0; i < q.size(); ++i) {
    axes.push_back(turned.col(i % 3));
    at.push_back(points.back());
    turned = turned * Eigen::AngleAxisd(q[i], Vec3::Unit(i % 3)).toRotationMatrix();
    points.push_back(points.back() + turned * Vec3(0.3, 0.1, 0.05));
  }
  if (jacobian) {
    jacobian->setZero(3 * static_cast<int>(points.size()), q.size());
    for (int k = 0; k < static_cast<int>(points.size()); ++k)
      for (int i = 0; i < k; ++i) jacobian->block<3, 1>(3 * k, i) = axes[i].cross(points[k] - at[i]);
  }
  return points;
}

// Sides that neighbours share are the same numbers, or their negatives: not even rounding differs.
TEST(WritheField, EqualsItsPairsToTheBit) {
  std::mt19937_64 random(5);
  Polyline first = random_chain(random, 9), second = random_chain(random, 14);
  second[4] = first[3];   // chains that touch
  second[8] = second[7];  // a segment of no length
  first[6] = 2 * first[5] - first[4];
  for (double most : {no_cap_1pm, 5.0}) {
    WritheField field(9, 14, most);
    for (int round = 0; round < 2; ++round) {
      field.evaluate(first, second);
      for (int i = 0; i < 8; ++i)
        for (int j = 0; j < 13; ++j) {
          SegmentGradient g;
          EXPECT_EQ(field.omega_sr()(i, j),
                    segment_writhe(first[i], first[i + 1], second[j], second[j + 1], g, most));
          const SegmentGradient& there = field.gradient(i, j);
          EXPECT_TRUE(there.a == g.a && there.b == g.b && there.c == g.c && there.d == g.d) << i << ' ' << j;
        }
      first[2].z() += 0.1;  // a second question is not answered by the first
    }
  }
}

class ChainAndPole : public testing::Test {
 protected:
  const Polyline pole_ = {{0, 0.3, -1}, {0.1, 0.4, 0}, {0, 0.3, 1}};
  const Eigen::VectorXd q_ = Eigen::VectorXd::LinSpaced(6, -0.5, 0.9);
  const Eigen::MatrixXd still_;
};

TEST_F(ChainAndPole, JointJacobianIsThatOfDifferences) {
  WritheField field(7, 3);
  Eigen::MatrixXd points, by_joints, by_sums;
  const Polyline chain = bent(q_, &points);
  field.evaluate(chain, pole_);
  field.by_joints(points, still_, by_joints);
  field.sums_by_joints(points, still_, by_sums);
  EXPECT_EQ(field.omega_sr(), writhe_matrix(chain, pole_));
  const double h = 1e-5;  // gap 0.1, lever 1: as above
  for (int joint = 0; joint < q_.size(); ++joint) {
    const Eigen::VectorXd step = h * Eigen::VectorXd::Unit(q_.size(), joint);
    const Eigen::MatrixXd slope =
        (writhe_matrix(bent(q_ + step), pole_) - writhe_matrix(bent(q_ - step), pole_)) / (2 * h);
    for (int i = 0; i < 6; ++i)
      for (int j = 0; j < 2; ++j) EXPECT_NEAR(by_joints(2 * i + j, joint), slope(i, j), 1e-7);
    EXPECT_LT((by_sums.col(joint).transpose() - writhe_sums(slope)).norm(), 1e-7);
  }
}

TEST_F(ChainAndPole, TheSecondChainMayMoveToo) {
  WritheField one(7, 3), other(3, 7);
  Eigen::MatrixXd points, first, second, sums_first, sums_second;
  const Polyline chain = bent(q_, &points);
  one.evaluate(chain, pole_);
  other.evaluate(pole_, chain);
  one.by_joints(points, still_, first);
  other.by_joints(still_, points, second);
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < 2; ++j) EXPECT_LT((first.row(2 * i + j) - second.row(6 * j + i)).norm(), 1e-13);
  other.sums_by_joints(still_, points, sums_second);
  for (int j = 0; j < 6; ++j)
    EXPECT_LT((sums_second.row(j) - first.row(2 * j) - first.row(2 * j + 1)).norm(), 1e-13);
}

TEST_F(ChainAndPole, PointGradientOfTheGaussIntegral) {
  WritheField field(7, 3);
  auto chain = bent(q_);
  field.evaluate(chain, pole_);
  Eigen::Matrix3Xd first, second;
  field.by_points(Eigen::MatrixXd::Constant(6, 2, 1 / (4 * M_PI)), first, second);
  const double h = 1e-5;
  for (int k = 0; k < 7; ++k)
    for (int axis = 0; axis < 3; ++axis) {
      chain[k][axis] += h;
      const double more = gauss_linking_integral(chain, pole_);
      chain[k][axis] -= 2 * h;
      const double less = gauss_linking_integral(chain, pole_);
      chain[k][axis] += h;
      EXPECT_NEAR(first(axis, k), (more - less) / (2 * h), 1e-8);  // 1e-7 / 4 pi
    }
  EXPECT_LT((first.rowwise().sum() + second.rowwise().sum()).norm(), 1e-14);
}

TEST_F(ChainAndPole, AsksForNoMemoryOnceItIsMade) {
  WritheField field(7, 3, 1e4);
  Eigen::MatrixXd points, by_joints, by_sums;
  Eigen::Matrix3Xd first, second;
  const Eigen::MatrixXd weights = Eigen::MatrixXd::Ones(6, 2);
  const Polyline chain = bent(q_, &points);
  const auto ask = [&] {
    field.evaluate(chain, pole_);
    field.by_joints(points, still_, by_joints);
    field.sums_by_joints(points, still_, by_sums);
    field.by_points(weights, first, second);
  };
  ask();  // the answers take their size
  const long before = tests::allocations();
  for (int i = 0; i < 100; ++i) ask();
  EXPECT_EQ(tests::allocations() - before, 0);
  const Polyline copy = chain;  // the count counts
  EXPECT_GT(tests::allocations() - before, 0);
}

}  // namespace
}  // namespace geocage::topology
