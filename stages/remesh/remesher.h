#pragma once
#include "geometry/surface_distance.h"
#include "stages/remesh/halfedges.h"

namespace geocage::stages {

/// The moves of the remesher, on one mesh over one source surface.
class Remesher {
 public:
  /// `edge_m` is the length that edges shall have.
  Remesher(const geometry::TriangleMesh& source, double edge_m);

  int vertices() const { return mesh_.vertices(); }
  geometry::TriangleMesh mesh() const { return mesh_.mesh(); }

  // Edges and vertices (resize.cpp)
  void split_longer(double longest_m);
  void collapse_shorter(double shortest_m);
  /// Collapses the shortest or splits the longest edges until there are `wanted` vertices.
  void meet_count(int wanted);
  /// Vertices with three or four triangles go.
  void remove_low_valences();

  // Flips (flips.cpp)
  void flip_for_valence();
  void flip_for_angle();

  // Places (relax.cpp)
  /// Moves each vertex towards the centroid of its ring, in the tangent plane, and back onto the source.
  void relax(int rounds);
  /// Moves corners of triangles with an angle below `low_rad` to where the smallest angle around is larger.
  void lift_angles(double low_rad);
  /// Collapses the shortest edge of triangles with an angle below `low_rad` and relaxes the neighbourhood.
  void remove_slim(double low_rad);
  /// Moves the corners of triangles that cut each other apart, off the source if need be.
  void part_cuts(int rounds);

 private:
  struct Folds {
    int count = 0;
    std::array<int, 2> ends{};  ///< of the first two
  };
  bool folded(int h) const;
  Folds folds(int v) const;

  std::vector<std::pair<double, int>> edges(double least_m, double most_m) const;
  void split(int h);
  bool collapse(int h, double longest_m);
  bool collapse_either(int h, double longest_m);

  bool flip_keeps_shape(int h) const;

  geometry::Vec3 ring_normal(int v) const;
  geometry::Vec3 wish(int v) const;
  void relax_vertex(int v);
  bool keeps_faces(int v, const geometry::Vec3& p) const;
  geometry::Vec3 projected(const geometry::Vec3& p, const geometry::Vec3& normal, int v);
  double least_angle_around(int v, const geometry::Vec3& p) const;
  double least_angle(int h) const;

  const geometry::SurfaceDistance source_;
  Halfedges mesh_;
  std::vector<int>
      near_;  ///< for each vertex a triangle of the source, the nearest one once it was projected
  const double edge_m_;
  const double flat_m2_;  ///< a triangle with less doubled area has no normal worth asking
};

/// Cosine of the angle between two vectors; -1 where one is zero.
double cos_between(const geometry::Vec3& a, const geometry::Vec3& b);
/// The smallest angle of a triangle [rad].
double least_angle(const geometry::Vec3& a, const geometry::Vec3& b, const geometry::Vec3& c);

}  // namespace geocage::stages
