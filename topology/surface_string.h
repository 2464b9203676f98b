#pragma once
#include <vector>

#include "topology/loops.h"
#include "topology/section.h"

namespace geocage::topology {

/// A closed string on a surface: it leaves triangle `face` through the edge from corner `side`, at the share
/// t of that edge, into the face of the next crossing.
struct Crossing {
  int face, side;
  double t;
};

/// The string along the vertices of a closed walk on edges, moved a little to its left. Precondition: closed
/// manifold; no edge is walked back at once.
std::vector<Crossing> string_along(const geometry::TriangleMesh& mesh, const NumberedEdges& edges,
                                   const std::vector<int>& walk);

/// Pulls a string tight without lifting it off the surface: crossings slide along their edges until no slide
/// shortens it (a convex problem), and where they meet at a vertex the string is passed over it if the angle
/// on the other side is less than pi (Xin and Wang 2007). Empty if it slips off. Ends at a closed geodesic,
/// or after a bounded number of rounds. The length never grows.
std::vector<Crossing> pull_tight(const geometry::TriangleMesh& mesh, const NumberedEdges& edges,
                                 std::vector<Crossing> string);

SurfaceLoop loop_of(const geometry::TriangleMesh& mesh, const std::vector<Crossing>& string);

}  // namespace geocage::topology
