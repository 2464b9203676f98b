#include "motion/tasks/writhe.h"

#include <cmath>

#include "topology/writhe.h"

namespace geocage::motion {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using topology::Polyline;

Task writhe_task(const MovingChain& chain, const Polyline& fixed, WritheForm form, const TargetOf& target,
                 std::vector<double> precision) {
  return {"writhe",
          [=](int t, const VectorXd& x, VectorXd& error, MatrixXd* J) {
            Polyline points;
            MatrixXd by_state;
            chain(x, points, J ? &by_state : nullptr);
            topology::WritheField field(static_cast<int>(points.size()), static_cast<int>(fixed.size()));
            field.evaluate(points, fixed);
            const MatrixXd still(0, x.size());
            MatrixXd rows;
            if (form == WritheForm::matrix) {
              error = field.omega_sr().transpose().reshaped();
              if (J) field.by_joints(by_state, still, rows);
            } else {
              error = topology::writhe_sums(field.omega_sr()).transpose();
              if (J) field.sums_by_joints(by_state, still, rows);
            }
            if (form == WritheForm::scalar) {
              error = VectorXd::Constant(1, error.sum() / (4 * M_PI));
              if (J) rows = MatrixXd(rows.colwise().sum() / (4 * M_PI));
            }
            error -= target(t);
            if (J) *J = rows;
          },
          std::move(precision)};
}

}  // namespace geocage::motion
