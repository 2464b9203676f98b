#pragma once
#include <array>
#include <vector>

#include "geometry/cloud.h"

namespace geocage::stages {

constexpr double clear_m = 0.008;  ///< a place is empty when what was seen lies that far behind it

/// What one sensor saw, as depths by direction: which places before it are empty.
class Sight {
 public:
  /// Points in the sensor's frame. Precondition: at least one, none at the sensor.
  explicit Sight(const std::vector<geometry::Vec3>& points);

  /// True where all that was seen around that direction lies at least `behind_m` behind p, and something was.
  bool empty(const geometry::Vec3& p, double behind_m) const;

  /// How much of the space between two things is empty: the share of middles between their points that are,
  /// of 400 pairs drawn evenly. 0 of two pieces of one convex thing, but for noise.
  double emptiness_between(const std::vector<geometry::Vec3>& a, const std::vector<geometry::Vec3>& b,
                           double behind_m) const;

  /// The nearest that a thing was seen right beside each direction.
  struct Front {
    int x = 0, y = 0, wide = 0, high = 0;  ///< cells
    std::vector<float> nearest_m;          ///< row by row; 0 where there is none
  };
  Front front_of(const std::vector<geometry::Vec3>& points) const;
  /// How much of the space between two things can't be seen for something else before it: the share of the
  /// same middles that lie `behind_m` behind what was seen there, but not behind one of the two.
  double hidden_between(const std::vector<geometry::Vec3>& a, const std::vector<geometry::Vec3>& b,
                        const Front& front_a, const Front& front_b, double behind_m) const;
  /// How many points of `things` are seen right beside a nearer one, by `step_m`, of the front.
  int hidden_behind(const std::vector<geometry::Vec3>& things, const Front& front, double step_m) const;

 private:
  int column(double tangent, int axis) const;
  std::array<int, 2> cell_of(const geometry::Vec3& p) const;  ///< -1 outside
  Eigen::Matrix3d frame_;                                     ///< z along the mean direction
  double low_[2];
  int cells_[2];
  std::vector<float> nearest_m_;  ///< of each cell; 0 where nothing was seen
};

/// What the cloud's first sensor saw. Precondition: its place is known.
Sight sight_of(const geometry::PointCloud& cloud);

}  // namespace geocage::stages
