#pragma once
#include <vector>

#include "geometry/mesh.h"
#include "geometry/repair.h"

// Steps of repair_mesh, each on triangles that need not fit together.
namespace geocage::geometry {

/// Triangles whose corners exist and are finite.
TriangleMesh sound_part(const TriangleMesh& mesh);

/// Drops triangles with bad indices, vertices that are not finite, no area (height below `weld_m`) or the
/// corners of another one; welds vertices nearer than `weld_m`; puts border vertices that lie on a border
/// side into it; leaves unused vertices out. O(F log F).
TriangleMesh clean_soup(const TriangleMesh& mesh, double weld_m, RepairCounts& counts);

/// Turns triangles so that neighbours agree, cuts where more than two meet at a side or where they can't
/// agree, and gives each fan of triangles a vertex of its own: a 2-manifold, maybe with borders. At a side of
/// more than two, triangles of the same sheet stay together, larger sheets first. O(F log F).
TriangleMesh cut_to_manifold(const TriangleMesh& mesh, RepairCounts& counts);
/// Vertices at the very same place move a thousandth of the way to their neighbours, so that fans of
/// triangles that were cut apart no longer touch.
void part_touching_vertices(TriangleMesh& mesh);

/// The component of each triangle (over shared vertices), numbered by first appearance.
std::vector<int> parts_of(const TriangleMesh& mesh, int& count);
/// Keeps the triangles for which `keep` is set; leaves unused vertices out.
TriangleMesh kept_triangles(const TriangleMesh& mesh, const std::vector<char>& keep);
/// Drops components with less than `smallest` of the whole area, or all but the largest one; answers how many
/// stay.
int drop_parts(TriangleMesh& mesh, double smallest, bool only_largest, RepairCounts& counts);

}  // namespace geocage::geometry
