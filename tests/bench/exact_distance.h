#pragma once
#include <memory>

#include "geometry/mesh.h"

namespace geocage::bench {

/// Unsigned distance to a mesh by CGAL's AABB tree: exact but for rounding, and no code of the field's.
class ExactDistance {
 public:
  explicit ExactDistance(const geometry::TriangleMesh& mesh);
  ~ExactDistance();
  double operator()(const geometry::Vec3& p_O) const;
  geometry::Vec3 nearest(const geometry::Vec3& p_O) const;

 private:
  struct Tree;
  std::unique_ptr<Tree> tree_;
};

}  // namespace geocage::bench
