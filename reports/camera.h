#pragma once
#include <vector>

#include "reports/picture.h"

namespace geocage::reports {

struct Ray {
  Vec3 origin, direction;  ///< direction is a unit vector
};

/// A pinhole camera that stands as near as it can while every point is in the picture.
class Camera {
 public:
  /// Precondition: view.up and view.from are not parallel.
  Camera(const View& view, double aspect, const std::vector<Part>& parts);
  /// x from left to right and y from top to bottom, both 0..1.
  Ray ray(double x, double y) const;
  Vec3 right() const { return right_; }
  Vec3 up() const { return up_; }
  Vec3 from() const { return from_; }

 private:
  Vec3 from_, right_, up_, eye_;
  double half_width_, half_height_;  ///< of the picture at distance 1
};

}  // namespace geocage::reports
