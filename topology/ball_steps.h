#pragma once
#include <cstdint>

// Walks along sections of balls, as many at a time as vectors have lanes; compiled for several instruction
// sets like ball_rows.h, with the same bytes from each.

namespace geocage::topology {

/// A section's plane: above is axis . p >= offset; u and v span it around its centre.
struct CutPlane {
  double axis[3], offset, u[3], v[3], center[3], source[3];
};

/// A crossed edge: the vertex above it in the upper 32 bits, the one below in the lower.
using Crossing = std::uint64_t;

/// The end of a crossed edge: its height over the plane, and how far it lies along v from the centre.
struct CutEnd {
  double height, v;
};

/// A walk's tip: the half-edge through which it enters the next triangle, and its ends above [0] and below
/// [1].
struct WalkTip {
  static constexpr int most_noted = 16;
  int half_edge = -1, home = -2;
  int ends[2];
  bool from_above;
  CutEnd places[2];
  double v;       ///< the cut point along v, times a positive number
  int turns = 0;  ///< how often it passed the half-line u < 0, v = 0, counter-clockwise
  bool closed = false;
  int noted = 0;
  Crossing notes[most_noted];  ///< the first crossings, the start's left out
};

/// One walk: in the ball of those vertices whose mask has the bit, to its end or back home; or only as far as
/// notes are taken.
struct SectionSteps {
  const CutPlane* plane;
  WalkTip* tip;
  const std::uint64_t* masks;  ///< the word that holds the ball's lane, of slot 0
  std::uint64_t bit;
  bool notes_only;
};

/// BallMesh's arrays and a region's slots; `slot` can be read one beyond its last vertex.
struct StepInput {
  const int* half_edges;  ///< of each: opposite vertex, two exits, start
  const double* points;   ///< x, y, z and another of each vertex
  const int* slot;
};

/// Takes all walks to their ends. Two words of masks a slot.
void walk_sections(const StepInput& input, SectionSteps* walks, int count);

/// Vertices by the cells of a grid, a row of cells along x after the other; coordinates from the grid's
/// corner. Arrays can be read 16 beyond their ends.
struct NearInput {
  const int *row_start, *items;
  const float *x, *y, *z, *reach;
  int cells_x, cells_y;
};
/// Writes at least all vertices of the cells low .. high whose distance from p is at most `radius` + their
/// reach, and returns their number; -1 where these cells hold more than `most`. 16 beyond `most` are written.
int near_vertices(const NearInput& input, const int* low, const int* high, const float* p, float radius,
                  int most, int* found);

/// Of the cut point on an edge along u, times the same positive number as WalkTip::v.
double along_u(const CutPlane& plane, const double* points, const int* ends, const CutEnd* places);

}  // namespace geocage::topology
