#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "geometry/mesh.h"
#include "pipeline/run.h"

namespace geocage::geometry {

struct RepairParams {
  double weld = 1e-6;            ///< vertices nearer than this become one, in diagonals of the mesh's box
  std::string parts = "joined";  ///< several parts: "joined" by a wrap, or only the "largest"
  double smallest_part = 0.01;   ///< parts with less than this share of the area are dropped
  double wrap_alpha = 0.02;      ///< openings that the wrap closes, in diagonals; its offset is a twentieth
  double most_moved = 0.05;      ///< a wrap that lies farther from the given surface is refused, in diagonals
  double timeout_s = 60;         ///< processor time of each step that runs in a worker process
  double memory_gib = 4;
  std::uint64_t seed = 1;  ///< of CGAL's random source
};

enum class RepairOutcome {
  untouched,  ///< it was fine: the mesh is the given one, bit by bit
  repaired,   ///< mended where it was broken, the rest is as given
  wrapped,    ///< an alpha wrap round the given triangles answers
  rejected    ///< no solid was found; `reason` and `triangles` say why, `mesh` is empty
};
std::string_view to_string(RepairOutcome outcome);

/// How often each repair was made.
struct RepairCounts {
  int bad_indices = 0, not_finite = 0, degenerate = 0, duplicate = 0;  ///< triangles dropped
  int welded = 0, isolated = 0;                                        ///< vertices merged, left out
  int t_junctions = 0;                                                 ///< vertices put into an opposite side
  int turned = 0;                                                      ///< triangles turned round
  int split = 0;     ///< vertices added because a vertex held several fans
  int parts = 0;     ///< components dropped
  int holes = 0;     ///< loops filled
  int crossing = 0;  ///< triangles taken out because they cross others, with those around them
};

struct Repair {
  RepairOutcome outcome = RepairOutcome::rejected;
  TriangleMesh mesh;
  RepairCounts counts;
  /// One-sided sampled distances (geometry/surface_distance.h): of the given triangles from the result (what
  /// was lost), and of the result from them (what was added). The Hausdorff distance is at most the larger
  /// one plus `sampling_m`.
  double lost_m = 0, added_m = 0, sampling_m = 0;
  std::string reason;          ///< first flaw of the given mesh; of a rejected one also what was tried
  std::vector<int> triangles;  ///< of the given mesh, those that have the flaw: the first of them
};

/// What keeps `mesh` from being a solid: one closed, 2-manifold, outward component that doesn't cut itself
/// (exact predicates) and has no unused vertices. Empty if nothing does; else a sentence with the elements,
/// the first few of which go to `triangles`.
std::string flaw_of_solid(const TriangleMesh& mesh, std::vector<int>* triangles = nullptr);

/// Makes a solid of any triangles, or says why it can't: flaw_of_solid of the answer is empty. Drops broken
/// elements, orients, cuts what is not manifold, fills holes (Liepa 2003), takes out what crosses itself and
/// fills again (after Attene 2010, section 4), and wraps (Portaneri et al. 2022) when that does not help.
/// Never throws for a bad mesh; steps that call CGAL's constructions run in a worker process. Same bytes for
/// the same mesh and parameters. `observed` stays only with an untouched mesh.
Repair repair_mesh(const TriangleMesh& mesh, const RepairParams& params = {});

/// Outcome, counts that are not zero, and distances as metrics `repair_*`.
void tell(const Repair& repair, pipeline::Run& run);

}  // namespace geocage::geometry
