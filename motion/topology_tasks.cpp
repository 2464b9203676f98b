#include "motion/topology_tasks.h"

#include <cmath>

#include "topology/winding_number.h"
#include "topology/writhe.h"

namespace geocage::motion {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using topology::Polyline;
using topology::Vec3;

TargetOf constant_target(const VectorXd& target) {
  return [target](int) { return target; };
}

TargetOf interpolated_target(const VectorXd& first, const VectorXd& last, int horizon) {
  return [=](int t) { return VectorXd(first + double(t) / horizon * (last - first)); };
}

Task winding_task(const MovingChain& chain, const Vec3& center, const Vec3& normal, const TargetOf& target,
                  std::vector<double> precision) {
  return {"winding number",
          [=](int t, const VectorXd& x, VectorXd& error, MatrixXd* J) {
            Polyline points;
            MatrixXd by_state;
            chain(x, points, J ? &by_state : nullptr);
            std::vector<Vec3> gradient;
            error = -target(t);
            error[0] +=
                topology::winding_number(points, center, normal, topology::Turning::is_signed, gradient);
            if (!J) return;
            *J = MatrixXd::Zero(1, x.size());
            for (std::size_t i = 0; i < points.size(); ++i)
              *J += gradient[i].transpose() * by_state.middleRows(3 * static_cast<Eigen::Index>(i), 3);
          },
          std::move(precision)};
}

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
