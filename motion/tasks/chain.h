#pragma once
#include <functional>

#include "motion/mover.h"
#include "motion/tasks/frame.h"
#include "topology/polyline.h"

namespace geocage::motion {

/// Points p_1 .. p_m [m] of a chain that moves with the state, and unless null their Jacobian, 3 m x dim, one
/// block of three rows below the other.
using MovingChain =
    std::function<void(const Eigen::VectorXd& x, topology::Polyline& points_m, Eigen::MatrixXd* jacobian)>;

/// Points fixed in links of a mover, one after the other. The mover must outlive the chain, which is for one
/// thread at a time.
MovingChain chain_of(const Mover& mover, std::vector<LinkFrame> points);

/// Of finger `finger`: the origins of its links from the palm out, and the tip (the far end of its last
/// capsule).
std::vector<LinkFrame> finger_points(const hands::Hand& hand, std::size_t finger);

}  // namespace geocage::motion
