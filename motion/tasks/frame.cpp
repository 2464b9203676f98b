#include "motion/tasks/frame.h"

#include <memory>

namespace geocage::motion {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

Pose pose_of(const Mover::Placed& placed, const LinkFrame& frame) {
  Pose X_LF = Pose::Identity();
  X_LF.translation() = frame.p_L;
  X_LF.linear() = frame.R_L;
  return placed.X_OL[static_cast<std::size_t>(frame.link)] * X_LF;
}

}  // namespace

Task position_task(const Mover& mover, const LinkFrame& point, const TargetOf& p_O,
                   std::vector<double> precision) {
  const auto evaluate = [&mover, point, p_O, placed = std::make_shared<Mover::Placed>()](
                            int t, const VectorXd& x, VectorXd& error, MatrixXd* J) {
    mover.place(x, *placed);
    const Vec3 p = placed->X_OL[static_cast<std::size_t>(point.link)] * point.p_L;
    error = p - p_O(t);
    if (!J) return;
    J->setZero(3, x.size());
    for (int i = 0; i < 3; ++i) mover.add_gradient(*placed, point.link, p, Vec3::Unit(i), J->row(i));
  };
  return {"position", evaluate, std::move(precision)};
}

Task orientation_task(const Mover& mover, const LinkFrame& frame, const std::function<Matrix3d(int)>& R_O,
                      std::vector<double> precision) {
  const auto evaluate = [&mover, frame, R_O, placed = std::make_shared<Mover::Placed>()](
                            int t, const VectorXd& x, VectorXd& error, MatrixXd* J) {
    mover.place(x, *placed);
    const Vec3 e = logarithm(pose_of(*placed, frame).linear() * R_O(t).transpose());
    error = e;
    if (!J) return;
    const Matrix3d by_turn = inverse_left_jacobian(e);
    J->setZero(3, x.size());
    for (int i = 0; i < 3; ++i) mover.add_turning(*placed, frame.link, by_turn.row(i), J->row(i));
  };
  return {"orientation", evaluate, std::move(precision)};
}

Task alignment_task(const Mover& mover, int link, const Vec3& axis_L, const Vec3& direction_O,
                    std::vector<double> precision) {
  const auto evaluate = [&mover, link, axis_L, direction_O, placed = std::make_shared<Mover::Placed>()](
                            int, const VectorXd& x, VectorXd& error, MatrixXd* J) {
    mover.place(x, *placed);
    const Vec3 axis_O = placed->X_OL[static_cast<std::size_t>(link)].linear() * axis_L;
    error = axis_O - direction_O;
    if (!J) return;
    J->setZero(3, x.size());
    // d axis = w x axis, so row i is (axis x e_i) . w.
    for (int i = 0; i < 3; ++i) mover.add_turning(*placed, link, axis_O.cross(Vec3::Unit(i)), J->row(i));
  };
  return {"alignment", evaluate, std::move(precision)};
}

Task relative_pose_task(const Mover& mover, const LinkFrame& A, const LinkFrame& B,
                        const std::function<Pose(int)>& X_AB, std::vector<double> precision) {
  const auto evaluate = [&mover, A, B, X_AB, placed = std::make_shared<Mover::Placed>()](
                            int t, const VectorXd& x, VectorXd& error, MatrixXd* J) {
    mover.place(x, *placed);
    const Pose X_OA = pose_of(*placed, A), X_OB = pose_of(*placed, B), wanted = X_AB(t),
               now = X_OA.inverse() * X_OB;
    const Vec3 turn = logarithm(now.linear() * wanted.linear().transpose());
    error.resize(6);
    error << now.translation() - wanted.translation(), turn;
    if (!J) return;
    J->setZero(6, x.size());
    const Matrix3d by_turn = inverse_left_jacobian(turn);
    const Vec3 p_A = X_OA.translation(), p_B = X_OB.translation();
    for (int i = 0; i < 3; ++i) {
      const Vec3 a_i = X_OA.linear().col(i);
      // p_AB in A's axes: A's own turn moves what it sees the other way round.
      mover.add_gradient(*placed, B.link, p_B, a_i, J->row(i));
      mover.add_gradient(*placed, A.link, p_A, -a_i, J->row(i));
      mover.add_turning(*placed, A.link, a_i.cross(p_B - p_A), J->row(i));
      const Vec3 g = X_OA.linear() * by_turn.row(i).transpose();
      mover.add_turning(*placed, B.link, g, J->row(3 + i));
      mover.add_turning(*placed, A.link, -g, J->row(3 + i));
    }
  };
  return {"relative pose", evaluate, std::move(precision)};
}

}  // namespace geocage::motion
