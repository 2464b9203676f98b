#include "motion/tasks/chain.h"

#include <algorithm>
#include <memory>

namespace geocage::motion {

MovingChain chain_of(const Mover& mover, std::vector<LinkFrame> points) {
  return [&mover, points = std::move(points), placed = std::make_shared<Mover::Placed>()](
             const Eigen::VectorXd& x, topology::Polyline& p_O, Eigen::MatrixXd* J) {
    mover.place(x, *placed);
    p_O.resize(points.size());
    if (J) J->setZero(3 * static_cast<Eigen::Index>(points.size()), x.size());
    for (std::size_t k = 0; k < points.size(); ++k) {
      p_O[k] = placed->X_OL[static_cast<std::size_t>(points[k].link)] * points[k].p_L;
      if (!J) continue;
      for (int i = 0; i < 3; ++i)
        mover.add_gradient(*placed, points[k].link, p_O[k], Vec3::Unit(i),
                           J->row(3 * static_cast<Eigen::Index>(k) + i));
    }
  };
}

std::vector<LinkFrame> finger_points(const hands::Hand& hand, std::size_t finger) {
  std::vector<int> links = hand.fingers[finger].links;
  std::sort(links.begin(), links.end());  // parents come first in a tree
  std::vector<LinkFrame> points;
  points.reserve(links.size() + 1);
  for (int link : links) points.push_back({link, Vec3::Zero(), Matrix3d::Identity()});
  Vec3 tip = Vec3::Zero();
  for (const auto& capsule : hand.capsules)
    if (capsule.link == links.back())
      for (const Vec3& end : {capsule.a_L, capsule.b_L})
        if (end.norm() > tip.norm()) tip = end;
  points.push_back({links.back(), tip, Matrix3d::Identity()});
  return points;
}

}  // namespace geocage::motion
