// Every hand and arm against orocos-kdl and against numerical differences.
#include <map>
#include <numbers>
#include <random>

#include <gtest/gtest.h>
#include <kdl/treefksolverpos_recursive.hpp>
#include <kdl/treejnttojacsolver.hpp>

#include "hands/hand.h"
#include "tests/hands/kdl_tree.h"

namespace geocage::hands {
namespace {

constexpr int postures = 1000;

Eigen::VectorXd random_posture(const KinematicTree& tree, std::mt19937_64& engine) {
  Eigen::VectorXd q(tree.dofs());
  for (int i = 0; i < q.size(); ++i) {
    const double share = static_cast<double>(engine() >> 11) * 0x1p-53;
    q[i] = tree.lower_rad[i] + share * (tree.upper_rad[i] - tree.lower_rad[i]);
  }
  return q;
}

/// A joint's value as rate * q[dof] + offset, by the URDF's own mimic elements.
struct Value {
  double rate = 1, offset = 0;
  std::string master;
};
Value value_of(const urdf::ModelInterface& model, const std::string& joint) {
  const auto mimic = model.getJoint(joint)->mimic;
  if (!mimic) return {1, 0, joint};
  const Value of_master = value_of(model, mimic->joint_name);
  return {mimic->multiplier * of_master.rate, mimic->multiplier * of_master.offset + mimic->offset,
          of_master.master};
}

/// By folder in `hands/`.
std::string urdf_of(const std::string& folder) {
  const std::filesystem::path path = std::filesystem::path(GEOCAGE_SOURCE_TREE) / "hands" / folder;
  return (path / (path.filename().string() + ".urdf")).string();
}

class EveryTree : public testing::TestWithParam<std::string> {
 protected:
  const KinematicTree tree_ = read_urdf(urdf_of(GetParam()));
  KinematicData data_{tree_};
};

TEST_P(EveryTree, AgreesWithOrocosKdl) {
  const tests::KdlTree kdl(urdf_of(GetParam()));
  KDL::TreeFkSolverPos_recursive place(kdl.tree);
  KDL::TreeJntToJacSolver jacobian_of(kdl.tree);
  KDL::JntArray q_kdl(kdl.tree.getNrOfJoints());
  KDL::Jacobian of_joints(kdl.tree.getNrOfJoints());
  std::map<std::string, Value> values;
  for (const auto& [name, joint] : kdl.model->joints_)
    if (joint->type != urdf::Joint::FIXED) values[name] = value_of(*kdl.model, name);
  std::mt19937_64 engine(1);
  // A chain of at most 8 joints with offsets below 0.3 m: some tens of rounding errors of 1e-16.
  constexpr double tolerance = 1e-12;
  for (int trial = 0; trial < postures; ++trial) {
    const Eigen::VectorXd q = random_posture(tree_, engine);
    for (const auto& [name, value] : values)
      q_kdl(kdl.index(kdl.model->getJoint(name)->child_link_name)) =
          value.rate * q[tree_.dof(value.master)] + value.offset;
    forward_kinematics(tree_, q, data_.X_HL);
    link_jacobians(tree_, data_);
    for (std::size_t link = 1; link < tree_.links.size(); ++link) {
      KDL::Frame frame;
      ASSERT_EQ(place.JntToCart(q_kdl, frame, tree_.links[link]), 0);
      ASSERT_EQ(jacobian_of.JntToJac(q_kdl, of_joints, tree_.links[link]), 0);
      const Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> rotation(frame.M.data);
      ASSERT_LT((data_.X_HL[link].linear() - rotation).norm(), tolerance) << tree_.links[link];
      ASSERT_LT((data_.X_HL[link].translation() - Eigen::Map<const Vec3>(frame.p.data)).norm(), tolerance);
      FrameJacobian expected = FrameJacobian::Zero(6, tree_.dofs());
      for (const auto& [name, value] : values)
        expected.col(tree_.dof(value.master)) +=
            value.rate * of_joints.data.col(kdl.index(kdl.model->getJoint(name)->child_link_name));
      ASSERT_LT((data_.jacobian(static_cast<int>(link)) - expected).norm(), tolerance) << tree_.links[link];
    }
  }
}

TEST_P(EveryTree, JacobiansAgreeWithCentralDifferences) {
  std::mt19937_64 engine(2);
  std::vector<Pose> X_plus, X_minus;
  FrameJacobian jacobian(6, tree_.dofs());
  Eigen::Matrix3Xd of_point(3, tree_.dofs());
  // h^2/6 of the third derivative (<= 1) = 2e-11, and rounding 1e-16/h = 1e-11.
  constexpr double h = 1e-5, tolerance = 1e-6, rounding = 1e-13;
  for (int trial = 0; trial < postures; ++trial) {
    const Eigen::VectorXd q = random_posture(tree_, engine);
    forward_kinematics(tree_, q, data_.X_HL);
    link_jacobians(tree_, data_);
    for (int i = 0; i < q.size(); ++i) {
      const Eigen::VectorXd step = h * Eigen::VectorXd::Unit(q.size(), i);
      forward_kinematics(tree_, q + step, X_plus);
      forward_kinematics(tree_, q - step, X_minus);
      for (std::size_t link = 0; link < tree_.links.size(); ++link) {
        Eigen::Matrix<double, 6, 1> slope;
        const Eigen::AngleAxisd turn(X_plus[link].linear() * X_minus[link].linear().transpose());
        slope << X_plus[link].translation() - X_minus[link].translation(), turn.angle() * turn.axis();
        ASSERT_LT((data_.jacobian(static_cast<int>(link)).col(i) - slope / (2 * h)).norm(), tolerance)
            << tree_.links[link] << ", " << tree_.dof_names[i];
      }
    }
    // The other two ways to the same numbers.
    const int link = static_cast<int>(engine() % tree_.links.size());
    const Vec3 p_H = data_.X_HL[link].translation();
    frame_jacobian(tree_, data_.X_HL, link, p_H, jacobian);
    point_jacobian(tree_, data_.X_HL, link, p_H, of_point);
    ASSERT_LT((data_.jacobian(link) - jacobian).norm(), rounding);
    ASSERT_LT((of_point - jacobian.topRows<3>()).norm(), rounding);
  }
}

std::vector<std::string> folders() {
  std::vector<std::string> with_urdf = {"arms/kuka_lwr4"};
  for (const auto& name : hand_names())
    if (std::filesystem::exists(urdf_of(name))) with_urdf.push_back(name);
  return with_urdf;
}
std::string test_name(const testing::TestParamInfo<std::string>& info) {
  return std::filesystem::path(info.param).filename().string();
}
INSTANTIATE_TEST_SUITE_P(Trees, EveryTree, testing::ValuesIn(folders()), test_name);

// Data sheet: 0.31 m shoulder, 0.40 m upper arm, 0.39 m forearm, 0.078 m wrist.
TEST(KukaLwr4, StandsAsTallAsItsDataSheet) {
  const KinematicTree tree = read_urdf(urdf_of("arms/kuka_lwr4"));
  KinematicData data(tree);
  forward_kinematics(tree, Eigen::VectorXd::Zero(7), data.X_HL);
  EXPECT_LT((data.X_HL.back().translation() - Vec3(0, 0, 0.31 + 0.40 + 0.39 + 0.078)).norm(), 1e-14);
  Eigen::VectorXd q = Eigen::VectorXd::Zero(7);
  q[1] = q[3] = std::numbers::pi / 2;  // shoulder towards -x, elbow back up
  forward_kinematics(tree, q, data.X_HL);
  EXPECT_LT((data.X_HL.back().translation() - Vec3(-0.40, 0, 0.31 + 0.39 + 0.078)).norm(), 1e-14);
}

}  // namespace
}  // namespace geocage::hands
