#include "motion/tasks/clearance.h"

#include <memory>

namespace geocage::motion {

using Eigen::MatrixXd;
using Eigen::VectorXd;

Task clearance_task(const Mover& mover, const Obstacles& obstacles, std::vector<double> margin_m,
                    std::vector<double> precision) {
  const auto evaluate = [&mover, obstacles, margin_m = std::move(margin_m),
                         placed = std::make_shared<Mover::Placed>()](int t, const VectorXd& x,
                                                                     VectorXd& error, MatrixXd* J) {
    const double margin = margin_m[static_cast<std::size_t>(t)];
    const auto per_ball = static_cast<Eigen::Index>(obstacles.fields.size()) + obstacles.support.has_value();
    error.setZero(static_cast<Eigen::Index>(mover.balls().size()) * per_ball);
    if (J) J->resize(error.size(), x.size());  // rows of sleeping hinges are not read
    if (margin <= 0) return;
    mover.place(x, *placed);
    Eigen::Index row = 0;
    const auto hinge = [&](const Mover::Ball& ball, const Vec3& p_O, double d, const Vec3& g) {
      error[row] = 1 - d / margin;
      if (!J) return;
      J->row(row).setZero();
      mover.add_gradient(*placed, ball.link, p_O, -g / margin, J->row(row));
    };
    for (const auto& ball : mover.balls()) {
      const Vec3 p_O = placed->X_OL[static_cast<std::size_t>(ball.link)] * ball.p_L;
      for (const auto& obstacle : obstacles.fields) {
        Vec3 g;
        const double d = (J ? obstacle.field->value(p_O, g) : obstacle.field->value(p_O)) - ball.radius_m;
        if (d < margin) hinge(ball, p_O, d, g);
        ++row;
      }
      if (!obstacles.support) continue;
      const double d = obstacles.support->height_m(p_O) - ball.radius_m;
      if (d < margin) hinge(ball, p_O, d, obstacles.support->normal);
      ++row;
    }
  };
  return {"clearance", evaluate, std::move(precision), true};
}

}  // namespace geocage::motion
