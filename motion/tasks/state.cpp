#include "motion/tasks/state.h"

namespace geocage::motion {

using Eigen::MatrixXd;
using Eigen::VectorXd;

Task state_task(const VectorXd& goal, std::vector<double> precision) {
  return posture_task(goal, 0, std::move(precision));
}

Task posture_task(const VectorXd& goal, Eigen::Index first, std::vector<double> precision) {
  return {"posture",
          [goal, first](int, const VectorXd& x, VectorXd& error, MatrixXd* J) {
            error = x.segment(first, goal.size()) - goal;
            if (!J) return;
            J->setZero(goal.size(), x.size());
            J->middleCols(first, goal.size()).setIdentity();
          },
          std::move(precision)};
}

}  // namespace geocage::motion
