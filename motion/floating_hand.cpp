#include "motion/floating_hand.h"

#include <algorithm>
#include <cmath>

namespace geocage::motion {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

Matrix3d cross_matrix(const Vec3& w) {
  Matrix3d W;
  W << 0, -w.z(), w.y(), w.z(), 0, -w.x(), -w.y(), w.x(), 0;
  return W;
}

Matrix3d exponential(const Vec3& w) {
  const double angle = w.norm();
  return angle > 0 ? Eigen::AngleAxisd(angle, w / angle).toRotationMatrix() : Matrix3d::Identity();
}

/// Left Jacobian of SO(3): exp(w + dw) = exp(J dw) exp(w) to first order.
Matrix3d left_jacobian(const Vec3& w) {
  const double a = w.norm();
  const Matrix3d W = cross_matrix(w);
  if (a < 1e-4) return Matrix3d::Identity() + W / 2 + W * W / 6;
  return Matrix3d::Identity() + (1 - std::cos(a)) / (a * a) * W + (a - std::sin(a)) / (a * a * a) * W * W;
}

}  // namespace

void FloatingHand::fill_balls() {
  for (const auto& capsule : hand_.capsules) {
    const Vec3 along = capsule.b_L - capsule.a_L;
    const int count = 1 + static_cast<int>(std::ceil(along.norm() / capsule.radius_m));
    for (int i = 0; i < count; ++i)
      balls_.push_back(
          {capsule.link, capsule.a_L + along * (count > 1 ? double(i) / (count - 1) : 0), capsule.radius_m});
  }
}

VectorXd FloatingHand::state(const Pose& X_OH, const VectorXd& q) const {
  VectorXd x(dim());
  const Eigen::AngleAxisd turn(X_OH.linear() * goal_.linear().transpose());
  x << (X_OH.translation() - goal_.translation()) / unit_m, turn.angle() * turn.axis(), q;
  return x;
}

Pose FloatingHand::pose(const VectorXd& x) const {
  Pose X_OH = goal_;
  X_OH.translation() += unit_m * x.head<3>();
  X_OH.linear() = exponential(x.segment<3>(3)) * goal_.linear();
  return X_OH;
}

void FloatingHand::place_links(const VectorXd& x, std::vector<Pose>& X_HL, std::vector<Pose>& X_OL) const {
  hands::forward_kinematics(hand_.tree, joints(x), X_HL);
  const Pose X_OH = pose(x);
  X_OL.resize(X_HL.size());
  for (std::size_t i = 0; i < X_HL.size(); ++i) X_OL[i] = X_OH * X_HL[i];
}

Eigen::RowVectorXd FloatingHand::gradient_row(const VectorXd& x, const std::vector<Pose>& X_HL, int link,
                                              const Vec3& p_O, const Vec3& g) const {
  const Pose X_OH = pose(x);
  const Vec3 arm = p_O - X_OH.translation();
  Eigen::Matrix3Xd joints_H = Eigen::Matrix3Xd::Zero(3, hand_.tree.dofs());
  hands::point_jacobian(hand_.tree, X_HL, link, X_OH.inverse() * p_O, joints_H);
  Eigen::RowVectorXd row(dim());
  row << unit_m * g.transpose(), arm.cross(g).transpose() * left_jacobian(x.segment<3>(3)),
      g.transpose() * X_OH.linear() * joints_H;
  return row;
}

Task clearance_task(const FloatingHand& hand, const geometry::SignedDistanceField& field,
                    const std::optional<geometry::Plane>& support, std::vector<double> margin_m,
                    std::vector<double> precision) {
  struct Near {
    int link;
    Vec3 p_O, g;  ///< gradient of the distance
    double distance_m;
  };
  const auto evaluate = [&hand, &field, support, margin_m](int t, const VectorXd& x, VectorXd& error,
                                                           MatrixXd* J) {
    const double margin = margin_m[static_cast<std::size_t>(t)];
    std::vector<Pose> X_HL, X_OL;
    hand.place_links(x, X_HL, X_OL);
    std::vector<Near> near;
    for (const auto& ball : hand.balls()) {
      const Vec3 p_O = X_OL[static_cast<std::size_t>(ball.link)] * ball.p_L;
      Vec3 g;
      if (const double d = field.value(p_O, g) - ball.radius_m; d < margin)
        near.push_back({ball.link, p_O, g, d});
      if (!support) continue;
      if (const double d = support->height_m(p_O) - ball.radius_m; d < margin)
        near.push_back({ball.link, p_O, support->normal, d});
    }
    const auto rows = static_cast<Eigen::Index>(margin > 0 ? near.size() : 0);
    error.resize(rows);
    if (J) J->resize(rows, x.size());
    for (Eigen::Index i = 0; i < rows; ++i) {
      const Near& n = near[static_cast<std::size_t>(i)];
      error[i] = 1 - n.distance_m / margin;
      if (J) J->row(i) = -hand.gradient_row(x, X_HL, n.link, n.p_O, n.g) / margin;
    }
  };
  return {"clearance", evaluate, std::move(precision)};
}

}  // namespace geocage::motion
