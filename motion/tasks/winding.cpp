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

std::vector<Task> wrapping_tasks(const Mover& mover, const VectorXd& start, const VectorXd& closed,
                                 int horizon, double precision) {
  struct Finger {
    MovingChain chain;
    topology::Vec3 normal;
  };
  std::vector<Finger> fingers;
  topology::Vec3 centre = topology::Vec3::Zero();
  double points = 0;
  for (std::size_t f = 0; f < mover.hand().fingers.size(); ++f) {
    Finger finger{chain_of(mover, finger_points(mover.hand(), f)), topology::Vec3::Zero()};
    topology::Polyline at;
    finger.chain(closed, at, nullptr);
    for (const topology::Vec3& p : at) centre += p;
    points += static_cast<double>(at.size());
    for (std::size_t i = 0; i + 2 < at.size(); ++i)
      finger.normal += (at[i + 1] - at[i]).cross(at[i + 2] - at[i + 1]);
    if (constexpr double straight_m2 = 1e-8; finger.normal.norm() < straight_m2) continue;
    finger.normal.normalize();
    fingers.push_back(std::move(finger));
  }
  centre /= points;
  std::vector<Task> tasks;
  for (const auto& [chain, normal] : fingers) {
    const Task turns = winding_task(chain, centre, normal, constant_target(VectorXd::Zero(1)), {});
    VectorXd first, last;
    turns.evaluate(0, start, first, nullptr);
    turns.evaluate(0, closed, last, nullptr);
    tasks.push_back(winding_task(chain, centre, normal, interpolated_target(first, last, horizon),
                                 constant_precision(horizon, precision)));
  }
  return tasks;
}

}  // namespace geocage::motion
