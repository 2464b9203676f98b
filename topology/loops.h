#pragma once
#include <optional>
#include <vector>

#include "geometry/mesh.h"
#include "topology/polyline.h"
#include "topology/section.h"

namespace geocage::topology {

/// Which side of the surface a loop bounds on: `around` a handle (a ring could be cut through the solid along
/// a disc), `through` its hole (the disc is outside the solid), or neither.
enum class LoopKind { around, through, mixed };

/// A closed curve on a surface, its last point joined to its first. Its points are on edges of the mesh and
/// its segments in triangles. `strip` are these in order, each beside the next, with those that it only
/// touches where it runs through a vertex: to cut the strip out is to cut along the curve.
struct SurfaceLoop {
  Polyline path;
  std::vector<int> strip;
  double length_m = 0;
  LoopKind kind = LoopKind::around;
};

/// For each handle one short loop around it and one through its hole, shortest first; 2 x genus in all, none
/// of them a sum of others.
///
/// Loops along edges are the shortest that consist of two shortest paths from one vertex and an edge, over
/// all vertices that any loop of a non-trivial class must pass (Erickson and Whittlesey 2005, "Greedy optimal
/// homotopy and homology generators"); loops around are chosen among the classes that nothing outside is
/// linked with, loops through among those that nothing inside is linked with. Each is then pulled tight
/// within its class: no loop near it on the surface is shorter. Fewer than 2 x genus only where such loops
/// don't make up a class's basis. Same bytes for any thread count. O(sqrt(V) V log V) on surfaces of even
/// triangles. Precondition: closed manifold, outward.
std::vector<SurfaceLoop> handle_loops(const geometry::TriangleMesh& mesh);

/// Where the plane through `center` with unit normal `axis` cuts the whole surface: the closed curve that
/// comes nearest to p. Nothing when the plane misses the surface. `edges` are the mesh's. O(F). Precondition:
/// closed manifold.
std::optional<SurfaceLoop> section_loop(const geometry::TriangleMesh& mesh, const NumberedEdges& edges,
                                        const Vec3& p, const Vec3& center, const Vec3& axis);

/// That curve pulled tight: the neck that a ring through the plane would slip into and stay. Nothing where it
/// slips off, which it does on everything that has no neck.
std::optional<SurfaceLoop> neck_loop(const geometry::TriangleMesh& mesh, const NumberedEdges& edges,
                                     const Vec3& p, const Vec3& center, const Vec3& axis);

}  // namespace geocage::topology
