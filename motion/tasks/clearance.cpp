#include "motion/tasks/clearance.h"

#include <algorithm>
#include <cmath>

namespace geocage::motion {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

/// A positive value falls by no more from a point to another that is `way_m` off. Inside the grid it is
/// within E <= sqrt(3) / 2 cells of a distance (DistanceBound), which falls by `way_m`; beyond, the nearest
/// point of the box and the way to it are at right angles, so both move by sqrt(2) way_m together. For a
/// map's field the same holds with the distance to the middle of the nearest solid cell, E once more and,
/// where the lesser value is next to a solid cell, (sqrt(3) - 1/2) cells in place of the other.
double change_m(const geometry::SignedDistanceField& field, double way_m) {
  return M_SQRT2 * way_m + 2.1 * field.cell_m;
}

}  // namespace

Task clearance_task(const Mover& mover, const Obstacles& obstacles, std::vector<double> margin_m,
                    std::vector<double> precision, std::shared_ptr<Mover::Placed> placed) {
  const auto evaluate = [&mover, obstacles, margin_m = std::move(margin_m), placed = std::move(placed)](
                            int t, const VectorXd& x, VectorXd& error, MatrixXd* J) {
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
    for (const Mover::Group& group : mover.groups()) {
      const Mover::Ball* ball = &mover.balls()[group.begin];
      const auto& X_OL = placed->X_OL[static_cast<std::size_t>(ball->link)];
      const Vec3 middle_O = X_OL * group.p_L;
      const bool far =
          std::all_of(obstacles.fields.begin(), obstacles.fields.end(),
                      [&](const auto& obstacle) {
                        return obstacle.field->value(middle_O) - change_m(*obstacle.field, group.radius_m) >=
                               margin;
                      }) &&
          (!obstacles.support || obstacles.support->height_m(middle_O) - group.radius_m >= margin);
      if (far) {
        row += static_cast<Eigen::Index>(group.end - group.begin) * per_ball;
        continue;
      }
      for (; ball != mover.balls().data() + group.end; ++ball) {
        const Vec3 p_O = X_OL * ball->p_L;
        for (const auto& obstacle : obstacles.fields) {
          Vec3 g;
          const double d = (J ? obstacle.field->value(p_O, g) : obstacle.field->value(p_O)) - ball->radius_m;
          if (d < margin) hinge(*ball, p_O, d, g);
          ++row;
        }
        if (!obstacles.support) continue;
        const double d = obstacles.support->height_m(p_O) - ball->radius_m;
        if (d < margin) hinge(*ball, p_O, d, obstacles.support->normal);
        ++row;
      }
    }
  };
  return {"clearance", evaluate, std::move(precision), true};
}

}  // namespace geocage::motion
