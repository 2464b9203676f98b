#include "topology/writhe.h"

#include <algorithm>
#include <cmath>

namespace geocage::topology {

namespace {

/// Corners p, q, r, s and their scalar products along the sides.
struct Parallelogram {
  const WritheCorner &p, &q, &r, &s;
  double pq, qr, rs, sp;

  /// Both triangles pqr and prs by Van Oosterom and Strackee (1983): tan of half the angle is numerator over
  /// denominator. Half angles are added by multiplying complex numbers, which saves an arctangent.
  double solid_angle() const {
    const double pr = p.at.dot(r.at);
    const Vec3 across = r.at.cross(p.at);
    const double y1 = q.at.dot(across);
    const double x1 = p.length * q.length * r.length + pq * r.length + qr * p.length + pr * q.length;
    const double y2 = -s.at.dot(across);
    const double x2 = p.length * r.length * s.length + pr * s.length + rs * p.length + sp * r.length;
    return -2 * std::atan2(x1 * y2 + y1 * x2, x1 * x2 - y1 * y2);
  }

  /// Segments in one plane see nothing of each other; rounding must not decide between 0 and 2 pi.
  bool flat(const Vec3& ab, const Vec3& cd) const {
    const double scale = std::max({p.length, q.length, r.length, s.length});
    const double volume = ab.dot(p.at.cross(cd));
    return volume * volume <= 1e-28 * scale * scale * ab.squaredNorm() * cd.squaredNorm();
  }
  double value(const Vec3& ab, const Vec3& cd) const { return flat(ab, cd) ? 0 : solid_angle(); }
};

/// The corners of one pair of segments.
struct Corners {
  WritheCorner p, q, r, s;
  Corners(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d)
      : p(c - a), q(d - a), r(d - b), s(c - b) {}
  Parallelogram all() const {
    return {p, q, r, s, p.at.dot(q.at), q.at.dot(r.at), r.at.dot(s.at), s.at.dot(p.at)};
  }
};

/// Value and gradient from the sides p-q, q-r, s-r and p-s.
double of_sides(const Vec3& ab, const Vec3& cd, const Parallelogram& all, const WritheSide& pq,
                const WritheSide& qr, const WritheSide& sr, const WritheSide& ps, double most_gradient_1pm,
                SegmentGradient& gradient) {
  if (!(pq.apart && qr.apart && sr.apart && ps.apart)) {
    gradient = {Vec3::Zero(), Vec3::Zero(), Vec3::Zero(), Vec3::Zero()};
    return 0;
  }
  const Vec3 dp = pq.by_u - ps.by_u, dq = pq.by_v + qr.by_u, dr = qr.by_v - sr.by_v,
             ds = -(sr.by_u + ps.by_v);
  // minus the solid angle, whose corners move with c, d, -a, -b
  gradient = {dp + dq, dr + ds, -(dp + ds), -(dq + dr)};
  const double longest2 = std::max({gradient.a.squaredNorm(), gradient.b.squaredNorm(),
                                    gradient.c.squaredNorm(), gradient.d.squaredNorm()});
  if (longest2 > most_gradient_1pm * most_gradient_1pm) {
    const double shrink = most_gradient_1pm / std::sqrt(longest2);
    for (Vec3* part : {&gradient.a, &gradient.b, &gradient.c, &gradient.d}) *part *= shrink;
  }
  return all.value(ab, cd);
}

}  // namespace

double segment_writhe(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  return Corners(a, b, c, d).all().value(b - a, d - c);
}

bool segments_touch(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  const Corners corners(a, b, c, d);
  const auto& [p, q, r, s] = corners;
  const auto all = corners.all();
  if (!all.flat(b - a, d - c)) return false;
  const bool apart = WritheSide(p, q).apart && WritheSide(q, r).apart && WritheSide(r, s).apart &&
                     WritheSide(s, p).apart && WritheSide(p, r).apart;  // the last one parts the triangles
  return !apart || std::abs(all.solid_angle()) > M_PI;  // 2 pi: the eye lies within one of them
}

double segment_writhe(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d, SegmentGradient& gradient,
                      double most_gradient_1pm) {
  const Corners corners(a, b, c, d);
  const auto& [p, q, r, s] = corners;
  return of_sides(b - a, d - c, corners.all(), {p, q}, {q, r}, {s, r}, {p, s}, most_gradient_1pm, gradient);
}

WritheField::WritheField(int first_points, int second_points, double most_gradient_1pm)
    : most_gradient_1pm_(most_gradient_1pm), omega_(first_points - 1, second_points - 1) {
  gradients_.resize(static_cast<std::size_t>(omega_.size()));
  for (Row* row : {&of_a_, &of_b_}) {
    row->corners.resize(static_cast<std::size_t>(second_points));
    row->sides.resize(static_cast<std::size_t>(second_points) - 1);
  }
  across_.resize(static_cast<std::size_t>(second_points));
}

void WritheField::Row::fill(const Vec3& a, const Polyline& second) {
  for (std::size_t j = 0; j < corners.size(); ++j) corners[j] = WritheCorner(second[j] - a);
  for (std::size_t j = 0; j < sides.size(); ++j) sides[j] = {corners[j], corners[j + 1]};
}

void WritheField::evaluate(const Polyline& first, const Polyline& second) {
  auto gradient = gradients_.begin();
  of_b_.fill(first[0], second);
  for (Eigen::Index i = 0; i < omega_.rows(); ++i) {
    std::swap(of_a_, of_b_);
    of_b_.fill(first[i + 1], second);
    const auto &a = of_a_.corners, &b = of_b_.corners;
    for (std::size_t j = 0; j < across_.size(); ++j) across_[j] = {a[j], b[j]};
    const Vec3 ab = first[i + 1] - first[i];
    for (Eigen::Index j = 0; j < omega_.cols(); ++j) {
      const WritheSide &pq = of_a_.sides[j], &qr = across_[j + 1], &sr = of_b_.sides[j], &ps = across_[j];
      const Parallelogram all = {a[j], a[j + 1], b[j + 1], b[j], pq.dot, qr.dot, sr.dot, ps.dot};
      omega_(i, j) =
          of_sides(ab, second[j + 1] - second[j], all, pq, qr, sr, ps, most_gradient_1pm_, *gradient++);
    }
  }
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
