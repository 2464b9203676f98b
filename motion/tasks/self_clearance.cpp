#include "motion/tasks/self_clearance.h"

#include <algorithm>
#include <memory>

#include "hands/closing.h"

namespace geocage::motion {

using Eigen::MatrixXd;
using Eigen::VectorXd;

SegmentGap segment_gap(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  constexpr double no_length = 1e-18;  // m^2
  const Vec3 u = b - a, v = d - c, w = a - c;
  const double uu = u.squaredNorm(), vv = v.squaredNorm(), uv = u.dot(v), uw = u.dot(w), vw = v.dot(w);
  SegmentGap gap;
  if (uu > no_length && vv > no_length) {
    const double det = uu * vv - uv * uv;
    gap.s = det > 1e-12 * uu * vv ? std::clamp((uv * vw - vv * uw) / det, 0.0, 1.0) : 0;
    gap.t = (uv * gap.s + vw) / vv;
    if (gap.t < 0 || gap.t > 1) {
      gap.t = std::clamp(gap.t, 0.0, 1.0);
      gap.s = std::clamp((uv * gap.t - uw) / uu, 0.0, 1.0);
    }
  } else if (uu > no_length) {
    gap.s = std::clamp(-uw / uu, 0.0, 1.0);
  } else if (vv > no_length) {
    gap.t = std::clamp(vw / vv, 0.0, 1.0);
  }
  gap.distance_m = (w + gap.s * u - gap.t * v).norm();
  return gap;
}

std::vector<std::pair<int, int>> self_pairs(const hands::Hand& body, const VectorXd& q) {
  const auto& tree = body.tree;
  // A link stands for all that are fixed to it.
  std::vector<int> rigid(tree.links.size(), 0), parent(tree.links.size(), -1);
  for (const auto& joint : tree.joints) {
    const auto child = static_cast<std::size_t>(joint.child_link);
    const int before = rigid[static_cast<std::size_t>(joint.parent_link)];
    const bool fixed = joint.type == hands::Joint::Type::fixed;
    rigid[child] = fixed ? before : joint.child_link;
    parent[child] = fixed ? parent[static_cast<std::size_t>(before)] : before;
  }
  std::vector<Pose> X_HL;
  std::vector<hands::PlacedCapsule> placed;
  hands::forward_kinematics(tree, q, X_HL);
  hands::place_capsules(body, Pose::Identity(), X_HL, placed);
  std::vector<std::pair<int, int>> pairs;
  for (int i = 0; i < static_cast<int>(placed.size()); ++i)
    for (int j = 0; j < i; ++j) {
      const auto link = [&](int k) {
        return rigid[static_cast<std::size_t>(body.capsules[static_cast<std::size_t>(k)].link)];
      };
      const int a = link(i), b = link(j);
      if (a == b || parent[static_cast<std::size_t>(a)] == b || parent[static_cast<std::size_t>(b)] == a)
        continue;
      if (hands::capsule_gap_m(placed[static_cast<std::size_t>(i)], placed[static_cast<std::size_t>(j)]) <= 0)
        continue;
      pairs.emplace_back(j, i);
    }
  return pairs;
}

Task self_clearance_task(const Mover& mover, std::vector<std::pair<int, int>> pairs, double margin_m,
                         std::vector<double> precision, std::shared_ptr<Mover::Placed> placed) {
  const auto evaluate = [&mover, pairs = std::move(pairs), margin_m, placed = std::move(placed),
                         capsules = std::make_shared<std::vector<hands::PlacedCapsule>>()](
                            int, const VectorXd& x, VectorXd& error, MatrixXd* J) {
    const hands::Hand& hand = mover.hand();
    mover.place(x, *placed);
    hands::place_capsules(hand, placed->X_OH, placed->X_HL, *capsules);
    error.setZero(static_cast<Eigen::Index>(pairs.size()));
    if (J) J->resize(error.size(), x.size());  // rows of sleeping hinges are not read
    for (std::size_t k = 0; k < pairs.size(); ++k) {
      const auto i = static_cast<std::size_t>(pairs[k].first), j = static_cast<std::size_t>(pairs[k].second);
      const auto &a = (*capsules)[i], &b = (*capsules)[j];
      const double reach = margin_m + a.radius_m + b.radius_m;
      const double halves = ((a.b - a.a).norm() + (b.b - b.a).norm()) / 2;
      if ((a.a + a.b - b.a - b.b).norm() / 2 > reach + halves) continue;
      const SegmentGap gap = segment_gap(a.a, a.b, b.a, b.b);
      if (gap.distance_m >= reach) continue;
      const auto row = static_cast<Eigen::Index>(k);
      error[row] = 1 - (gap.distance_m - a.radius_m - b.radius_m) / margin_m;
      if (!J) continue;
      J->row(row).setZero();
      const Vec3 p = a.a + gap.s * (a.b - a.a), q = b.a + gap.t * (b.b - b.a);
      if (gap.distance_m < 1e-9) continue;  // axes cross: no way out is nearer than another
      const Vec3 g = (p - q) / (gap.distance_m * margin_m);
      mover.add_gradient(*placed, hand.capsules[i].link, p, -g, J->row(row));
      mover.add_gradient(*placed, hand.capsules[j].link, q, g, J->row(row));
    }
  };
  return {"self-collision", evaluate, std::move(precision), true};
}

}  // namespace geocage::motion
