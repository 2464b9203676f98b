#pragma once
#include <limits>
#include <vector>

#include <Eigen/Core>

#include "topology/polyline.h"
#include "topology/writhe_pair.h"

namespace geocage::topology {

/// Signed solid angle [sr] under which the segments ab and cd see each other, in [-2 pi, 2 pi]: the double
/// integral of Gauss over the two segments (thesis eq. 3.1, in the arctangent form that needs no clamp). 0
/// for segments that lie in one plane: parallel ones, those that share an end or have no length. Jumps by
/// 4 pi where the segments cross.
double segment_writhe(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d);

/// Whether the segments share a point, to rounding: there the value jumps and the 0 is a convention.
bool segments_touch(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d);

/// Derivatives of a segment_writhe by its four points [sr/m]; they add up to zero.
struct SegmentGradient {
  Vec3 a, b, c, d;
};

constexpr double no_cap_1pm = std::numeric_limits<double>::infinity();

/// The value and its derivatives, exact also where the value is 0 because the segments lie in one plane.
/// Where an end comes near to the other segment the gradient grows like 1 / gap: when one of its four parts
/// is longer than `most_gradient_1pm` all are scaled down together, which keeps their direction and their
/// sum. Segments that touch, share an end or overlap have no gradient: zero, and the value 0.
double segment_writhe(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d, SegmentGradient& gradient,
                      double most_gradient_1pm = no_cap_1pm);

/// Omega_ij [sr] of segment i of `first` and j of `second`, (n-1) x (m-1). O(n m).
/// Precondition: at least two points each.
Eigen::MatrixXd writhe_matrix(const Polyline& first, const Polyline& second);

/// w_j = sum_i Omega_ij [sr] (thesis 3.1): how much the whole first chain winds round segment j of the
/// second.
Eigen::RowVectorXd writhe_sums(const Eigen::MatrixXd& omega_sr);

/// Sum of the writhe matrix over 4 pi (thesis eq. 2.1): the linking number of two closed curves.
double gauss_linking_integral(const Polyline& first, const Polyline& second);

/// Writhe of one polyline: sum over i != j of Omega_ij / 4 pi; closed joins the last point to the first.
double writhe_of_open(const Polyline& curve);
double writhe_of_closed(const Polyline& curve);

/// Writhe matrix of two chains of fixed lengths with its derivatives, for planners that ask again and again:
/// all memory is taken when it is made.
class WritheField {
 public:
  /// Numbers of points, at least two each.
  WritheField(int first_points, int second_points, double most_gradient_1pm = no_cap_1pm);

  /// Fills omega and all gradients; allocates nothing. O(n m). Precondition: as many points as announced.
  void evaluate(const Polyline& first, const Polyline& second);

  const Eigen::MatrixXd& omega_sr() const { return omega_; }
  const SegmentGradient& gradient(int i, int j) const { return gradients_[i * omega_.cols() + j]; }

  /// Derivatives by joints of all entries [sr per joint unit], row i (m - 1) + j for Omega_ij: `jacobian` is
  /// (n-1)(m-1) x joints. The 3 x joints blocks of `first` and `second`, one below the other, are the
  /// Jacobians [m per joint unit] of the chains' points; a chain without rows stands still. Allocates nothing
  /// when `jacobian` has its size. O(n m joints).
  void by_joints(const Eigen::MatrixXd& first, const Eigen::MatrixXd& second,
                 Eigen::MatrixXd& jacobian) const;

  /// The same for the sums w_j: (m-1) x joints. About a quarter of by_joints's work, since gradients are
  /// added up before they meet the joints.
  void sums_by_joints(const Eigen::MatrixXd& first, const Eigen::MatrixXd& second,
                      Eigen::MatrixXd& jacobian) const;

  /// Derivatives of sum_ij weight_ij Omega_ij by all points [weight sr/m]: columns are points. With weights
  /// 1 / 4 pi the gradient of the Gauss linking integral. `second` gives those of the second chain's points.
  void by_points(const Eigen::MatrixXd& weights, Eigen::Matrix3Xd& first, Eigen::Matrix3Xd& second) const;

 private:
  /// What a point of the first chain has with all of the second.
  struct Row {
    std::vector<WritheCorner> corners;
    std::vector<WritheSide> sides;
    void fill(const Vec3& a, const Polyline& second);
  };

  double most_gradient_1pm_;
  Row of_a_, of_b_;                 ///< of both ends of a segment of the first chain
  std::vector<WritheSide> across_;  ///< between them
  Eigen::MatrixXd omega_;
  std::vector<SegmentGradient> gradients_;
};

}  // namespace geocage::topology
