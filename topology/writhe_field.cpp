#include <algorithm>

#include "topology/writhe.h"

namespace geocage::topology {

void WritheField::by_joints(const Eigen::MatrixXd& first, const Eigen::MatrixXd& second,
                            Eigen::MatrixXd& jacobian) const {
  jacobian.setZero(omega_.size(), std::max(first.cols(), second.cols()));
  Eigen::Index row = 0;
  for (Eigen::Index i = 0; i < omega_.rows(); ++i)
    for (Eigen::Index j = 0; j < omega_.cols(); ++j, ++row) {
      const SegmentGradient& by = gradients_[static_cast<std::size_t>(row)];
      auto of_pair = jacobian.row(row);
      if (first.rows() > 0) {
        of_pair.noalias() += by.a.transpose() * first.middleRows<3>(3 * i);
        of_pair.noalias() += by.b.transpose() * first.middleRows<3>(3 * i + 3);
      }
      if (second.rows() > 0) {
        of_pair.noalias() += by.c.transpose() * second.middleRows<3>(3 * j);
        of_pair.noalias() += by.d.transpose() * second.middleRows<3>(3 * j + 3);
      }
    }
}

void WritheField::sums_by_joints(const Eigen::MatrixXd& first, const Eigen::MatrixXd& second,
                                 Eigen::MatrixXd& jacobian) const {
  jacobian.setZero(omega_.cols(), std::max(first.cols(), second.cols()));
  for (int j = 0; j < omega_.cols(); ++j) {
    auto of_sum = jacobian.row(j);
    Vec3 c = Vec3::Zero(), d = Vec3::Zero(), before = Vec3::Zero();  // `before`: b of the segment before
    for (int i = 0; i < omega_.rows(); ++i) {
      const SegmentGradient& by = gradient(i, j);
      if (first.rows() > 0) of_sum.noalias() += (before + by.a).transpose() * first.middleRows<3>(3 * i);
      before = by.b;
      c += by.c;
      d += by.d;
    }
    if (first.rows() > 0) of_sum.noalias() += before.transpose() * first.middleRows<3>(3 * omega_.rows());
    if (second.rows() == 0) continue;
    of_sum.noalias() += c.transpose() * second.middleRows<3>(3 * j);
    of_sum.noalias() += d.transpose() * second.middleRows<3>(3 * j + 3);
  }
}

void WritheField::by_points(const Eigen::MatrixXd& weights, Eigen::Matrix3Xd& first,
                            Eigen::Matrix3Xd& second) const {
  first.setZero(3, omega_.rows() + 1);
  second.setZero(3, omega_.cols() + 1);
  for (int i = 0; i < omega_.rows(); ++i)
    for (int j = 0; j < omega_.cols(); ++j) {
      const SegmentGradient& by = gradient(i, j);
      const double w = weights(i, j);
      first.col(i) += w * by.a;
      first.col(i + 1) += w * by.b;
      second.col(j) += w * by.c;
      second.col(j + 1) += w * by.d;
    }
}

}  // namespace geocage::topology
