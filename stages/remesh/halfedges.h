#pragma once
#include "geometry/mesh.h"

namespace geocage::stages {

/// A closed manifold of triangles whose edges can be flipped, split and collapsed. Halfedge 3 t + i runs from
/// corner i of triangle t to the next corner. Removed triangles and vertices leave holes in the arrays until
/// `mesh()` closes them.
class Halfedges {
 public:
  /// Precondition: every edge has two triangles, oriented alike. A vertex with several fans of triangles
  /// becomes one vertex a fan.
  explicit Halfedges(const geometry::TriangleMesh& mesh);
  geometry::TriangleMesh mesh() const;

  std::vector<geometry::Vec3> position;

  int halfedges() const { return static_cast<int>(from_.size()); }
  bool alive(int h) const { return from_[h] >= 0; }
  int slots() const { return static_cast<int>(position.size()); }  ///< vertices, removed ones too
  bool vertex_alive(int v) const { return out_[v] >= 0; }
  int vertices() const { return vertices_; }

  static int next(int h) { return h % 3 == 2 ? h - 2 : h + 1; }
  static int prev(int h) { return h % 3 == 0 ? h + 2 : h - 1; }
  int twin(int h) const { return twin_[h]; }
  int from(int h) const { return from_[h]; }
  int to(int h) const { return from_[next(h)]; }
  int opposite(int h) const { return from_[prev(h)]; }
  int out(int v) const { return out_[v]; }  ///< a halfedge from v
  int valence(int v) const { return valence_[v]; }

  /// Calls `f` with each halfedge from v, clockwise seen from outside.
  template <class F>
  void around(int v, F&& f) const {
    int h = out_[v];
    do {
      f(h);
      h = next(twin_[h]);
    } while (h != out_[v]);
  }

  double length2(int h) const { return (position[to(h)] - position[from(h)]).squaredNorm(); }
  geometry::Vec3 double_area_normal(int h) const;  ///< of the triangle of h
  /// Of the triangle of h if its vertex `v` were at `p`.
  geometry::Vec3 double_area_normal_with(int h, int v, const geometry::Vec3& p) const;

  /// False where the new edge exists already or an end has only three triangles.
  bool can_flip(int h) const;
  void flip(int h);
  /// A new vertex at `p` in the edge of h; answers its index.
  int split(int h, const geometry::Vec3& p);
  /// The link condition: the mesh stays a manifold of the same genus when the edge of h shrinks to a vertex.
  bool can_collapse(int h) const;
  /// from(h) goes, to(h) stays where it is.
  void collapse(int h);

 private:
  bool connected(int a, int b) const;
  void join(int h, int g) {
    twin_[h] = g;
    twin_[g] = h;
  }

  std::vector<int> from_, twin_, out_, valence_;
  int vertices_ = 0;
};

}  // namespace geocage::stages
