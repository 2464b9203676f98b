// Principal axes of many balls at once against Eigen's solver, for every instruction set.
#include "topology/ball_axes.h"

#include <cmath>
#include <cstring>
#include <random>
#include <vector>

#include <Eigen/Eigenvalues>
#include <gtest/gtest.h>

#include "geometry/instruction_sets.h"

namespace geocage::topology {
namespace {

/// Sums of clouds of points, from round to flat and long ones, about an origin that is not their mean.
std::vector<double> clouds() {
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  std::vector<double> sums(lanes * sum_slots);
  for (int l = 0; l < lanes; ++l) {
    const Eigen::Vector3d sizes(1, l % 8 == 0 ? 1 : std::abs(normal(random)),
                                l % 3 == 0 ? 0 : normal(random));
    const Eigen::Matrix3d turn =
        Eigen::Quaterniond(normal(random), normal(random), normal(random), normal(random))
            .normalized()
            .toRotationMatrix();
    double* sum = sums.data() + l * sum_slots;
    for (int i = 0; i < 4 + l; ++i) {
      const Eigen::Vector3d p =
          Eigen::Vector3d(2, -1, 0.5) +
          turn * sizes.cwiseProduct(Eigen::Vector3d(normal(random), normal(random), normal(random)));
      sum[slot_count] += 1;
      for (int k = 0; k < 3; ++k) sum[slot_x + k] += p[k];
      int slot = slot_xx;
      for (int k = 0; k < 3; ++k)
        for (int j = k; j < 3; ++j) sum[slot++] += p[k] * p[j];
    }
  }
  return sums;
}

// The vector is a cross product of more than 1e-3 of the eigenvalue's square, else it is said to be unsure:
// rounding of 1e-15 and a loss of 1e3 in it, and the same in what Eigen does; the origin loses a factor
// of 10.
TEST(BallAxes, EqualEigensSolver) {
  const double guard = 1.1;
  const auto sums = clouds();
  const char* names[8];
  const int sets = geometry::instruction_sets(names, 8);
  std::vector<LaneAxes> found(static_cast<std::size_t>(sets));
  for (int i = 0; i < sets; ++i) {
    geometry::force_instruction_set(names[i]);
    principal_axes(sums.data(), lanes, guard, found[i]);
    EXPECT_EQ(std::memcmp(found[i].axis, found[0].axis, sizeof(found[0].axis)), 0) << names[i];
    EXPECT_EQ(std::memcmp(found[i].state, found[0].state, sizeof(found[0].state)), 0) << names[i];
  }
  geometry::force_instruction_set("");
  int dominant = 0, unsure = 0;
  for (int l = 0; l < lanes; ++l) {
    const double *sum = sums.data() + l * sum_slots, n = sum[slot_count];
    const Eigen::Vector3d mean = Eigen::Vector3d(sum[slot_x], sum[slot_y], sum[slot_z]) / n;
    Eigen::Matrix3d scatter;
    scatter << sum[slot_xx], sum[slot_xy], sum[slot_xz], sum[slot_xy], sum[slot_yy], sum[slot_yz],
        sum[slot_xz], sum[slot_yz], sum[slot_zz];
    scatter -= n * mean * mean.transpose();
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(scatter);
    const LaneAxes& axes = found[0];
    for (int k = 0; k < 3; ++k) EXPECT_DOUBLE_EQ(axes.mean[k][l], mean[k]);
    unsure += axes.state[l] == LaneAxes::unsure;
    if (axes.state[l] == LaneAxes::unsure) continue;
    const Eigen::Vector3d values = solver.eigenvalues();
    EXPECT_EQ(axes.state[l] == LaneAxes::dominant, values[2] >= guard * values[1]) << l;
    dominant += axes.state[l] == LaneAxes::dominant;
    const Eigen::Vector3d axis(axes.axis[0][l], axes.axis[1][l], axes.axis[2][l]);
    EXPECT_LT(axis.cross(solver.eigenvectors().col(2)).norm(), 1e-10) << l;
  }
  EXPECT_GT(dominant, lanes / 2);
  EXPECT_LT(unsure, lanes / 8);
}

}  // namespace
}  // namespace geocage::topology
