#include "motion/tasks/limits.h"

namespace geocage::motion {

using Eigen::MatrixXd;
using Eigen::VectorXd;

Task limits_task(const VectorXd& lower, const VectorXd& upper, std::vector<double> precision) {
  return {"limits",
          [lower, upper](int, const VectorXd& x, VectorXd& error, MatrixXd* J) {
            error = (x - upper).cwiseMax(0) - (lower - x).cwiseMax(0);
            if (J) *J = (error.array() != 0).cast<double>().matrix().asDiagonal();
          },
          std::move(precision), true};
}

}  // namespace geocage::motion
