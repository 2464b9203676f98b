#include "tests/bench/exact_distance.h"

#include <CGAL/AABB_face_graph_triangle_primitive.h>
#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>

#include "geometry/cgal_mesh.h"

namespace geocage::bench {

using Primitive = CGAL::AABB_face_graph_triangle_primitive<geometry::CgalMesh>;

struct ExactDistance::Tree {
  geometry::CgalMesh mesh;
  CGAL::AABB_tree<CGAL::AABB_traits<geometry::CgalKernel, Primitive>> boxes;
};

ExactDistance::ExactDistance(const geometry::TriangleMesh& mesh)
    : tree_(new Tree{geometry::to_cgal(mesh), {}}) {
  tree_->boxes.rebuild(faces(tree_->mesh).first, faces(tree_->mesh).second, tree_->mesh);
  tree_->boxes.accelerate_distance_queries();
}

ExactDistance::~ExactDistance() = default;

double ExactDistance::operator()(const geometry::Vec3& p) const {
  return (nearest(p) - p).norm();
}

geometry::Vec3 ExactDistance::nearest(const geometry::Vec3& p) const {
  const auto q = tree_->boxes.closest_point({p.x(), p.y(), p.z()});
  return {q.x(), q.y(), q.z()};
}

}  // namespace geocage::bench
