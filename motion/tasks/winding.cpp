#include "motion/tasks/winding.h"

#include "topology/winding_number.h"

namespace geocage::motion {

using Eigen::MatrixXd;
using Eigen::VectorXd;

Task winding_task(const MovingChain& chain, const topology::Vec3& center, const topology::Vec3& normal,
                  const TargetOf& target, std::vector<double> precision) {
  return {"winding number",
          [=](int t, const VectorXd& x, VectorXd& error, MatrixXd* J) {
            topology::Polyline points;
            MatrixXd by_state;
            chain(x, points, J ? &by_state : nullptr);
            std::vector<topology::Vec3> gradient;
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

}  // namespace geocage::motion
