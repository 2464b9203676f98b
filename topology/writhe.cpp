#include "topology/writhe.h"

#include <algorithm>
#include <cmath>

namespace geocage::topology {

namespace {

// The differences between points of two segments fill a parallelogram with the corners p = c - a, q = d - a,
// r = d - b, s = c - b: Omega is the solid angle that it fills for an eye at the origin.
struct Parallelogram {
  Vec3 p, q, r, s;
  double lp, lq, lr, ls;

  Parallelogram(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d)
      : p(c - a), q(d - a), r(d - b), s(c - b), lp(p.norm()), lq(q.norm()), lr(r.norm()), ls(s.norm()) {}

  /// Both triangles pqr and prs by Van Oosterom and Strackee (1983): tan of half the angle is numerator over
  /// denominator. Half angles are added by multiplying complex numbers, which saves an arctangent.
  double solid_angle() const {
    const double pr = p.dot(r);
    const Vec3 across = r.cross(p);
    const double y1 = q.dot(across), x1 = lp * lq * lr + p.dot(q) * lr + q.dot(r) * lp + pr * lq;
    const double y2 = -s.dot(across), x2 = lp * lr * ls + pr * ls + r.dot(s) * lp + s.dot(p) * lr;
    return -2 * std::atan2(x1 * y2 + y1 * x2, x1 * x2 - y1 * y2);
  }
};

/// Segments in one plane see nothing of each other; rounding must not decide between 0 and 2 pi.
bool flat(const Vec3& ab, const Vec3& cd, const Parallelogram& all) {
  const double scale = std::max({all.lp, all.lq, all.lr, all.ls});
  const double volume = ab.dot(all.p.cross(cd));
  return volume * volume <= 1e-28 * scale * scale * ab.squaredNorm() * cd.squaredNorm();
}

/// Change of a polygon's solid angle with one of its edges: moving x of the edge uv by dx sweeps
/// (dx x dl) . x / |x|^3 (the law of Biot and Savart). Integrated over the edge, where dx runs linearly from
/// du to dv, that is du . n / |u| + dv . n / |v| with n = v x u / (|u| |v| + u . v): one term an edge, and
/// infinite only where the edge goes through the eye. False if it does.
bool add_edge(const Vec3& u, double lu, const Vec3& v, double lv, Vec3& du, Vec3& dv) {
  const Vec3 across = v.cross(u);
  const double product = lu * lv, dot = u.dot(v), area2 = across.squaredNorm();
  if (dot <= 0 && area2 <= 1e-30 * product * product) return false;
  // Of opposite arrows the sum |u| |v| + u . v is a small difference: area^2 over the other sum is the same.
  const double shrink = dot > 0 ? 1 / (product + dot) : (product - dot) / area2;
  du += shrink / lu * across;
  dv += shrink / lv * across;
  return true;
}

}  // namespace

double segment_writhe(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  const Parallelogram all(a, b, c, d);
  return flat(b - a, d - c, all) ? 0 : all.solid_angle();
}

bool segments_touch(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  const Parallelogram all(a, b, c, d);
  if (!flat(b - a, d - c, all)) return false;
  Vec3 unused = Vec3::Zero();
  const bool apart =
      add_edge(all.p, all.lp, all.q, all.lq, unused, unused) &&
      add_edge(all.q, all.lq, all.r, all.lr, unused, unused) &&
      add_edge(all.r, all.lr, all.s, all.ls, unused, unused) &&
      add_edge(all.s, all.ls, all.p, all.lp, unused, unused) &&
      add_edge(all.p, all.lp, all.r, all.lr, unused, unused);  // the diagonal of both triangles
  return !apart || std::abs(all.solid_angle()) > M_PI;         // 2 pi: the eye lies within one of them
}

double segment_writhe(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d, SegmentGradient& gradient,
                      double most_gradient_1pm) {
  const Parallelogram all(a, b, c, d);
  Vec3 dp = Vec3::Zero(), dq = dp, dr = dp, ds = dp;
  const bool apart =
      add_edge(all.p, all.lp, all.q, all.lq, dp, dq) && add_edge(all.q, all.lq, all.r, all.lr, dq, dr) &&
      add_edge(all.r, all.lr, all.s, all.ls, dr, ds) && add_edge(all.s, all.ls, all.p, all.lp, ds, dp);
  if (!apart) {
    gradient = {Vec3::Zero(), Vec3::Zero(), Vec3::Zero(), Vec3::Zero()};
    return 0;
  }
  gradient = {dp + dq, dr + ds, -(dp + ds),
              -(dq + dr)};  // minus the solid angle, whose corners move with c, d, -a, -b
  const double longest = std::sqrt(std::max({gradient.a.squaredNorm(), gradient.b.squaredNorm(),
                                             gradient.c.squaredNorm(), gradient.d.squaredNorm()}));
  if (longest > most_gradient_1pm) {
    const double shrink = most_gradient_1pm / longest;
    for (Vec3* part : {&gradient.a, &gradient.b, &gradient.c, &gradient.d}) *part *= shrink;
  }
  return flat(b - a, d - c, all) ? 0 : all.solid_angle();
}

Eigen::MatrixXd writhe_matrix(const Polyline& first, const Polyline& second) {
  const auto rows = static_cast<Eigen::Index>(first.size()) - 1,
             columns = static_cast<Eigen::Index>(second.size()) - 1;
  Eigen::MatrixXd omega(rows, columns);
  for (Eigen::Index i = 0; i < rows; ++i)
    for (Eigen::Index j = 0; j < columns; ++j)
      omega(i, j) = segment_writhe(first[i], first[i + 1], second[j], second[j + 1]);
  return omega;
}

Eigen::RowVectorXd writhe_sums(const Eigen::MatrixXd& omega_sr) {
  return omega_sr.colwise().sum();
}

double gauss_linking_integral(const Polyline& first, const Polyline& second) {
  return writhe_matrix(first, second).sum() / (4 * M_PI);
}

double writhe_of_open(const Polyline& curve) {
  return gauss_linking_integral(curve, curve);  // a segment sees nothing of itself
}

double writhe_of_closed(const Polyline& curve) {
  Polyline closed = curve;
  closed.push_back(curve.front());
  return writhe_of_open(closed);
}

}  // namespace geocage::topology
