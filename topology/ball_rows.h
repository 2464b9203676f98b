#pragma once
#include <cstdint>

// Lane-parallel kernels over the region of a patch: vector code, compiled for several instruction sets and
// chosen at run time (Highway). Plain pointers only, so that nothing else is compiled differently. Every
// instruction set gives the same bytes: whole numbers, and doubles added in the same order.

namespace geocage::topology {

constexpr int lanes = 128;        ///< sources of a patch; one row of 128 bytes holds a byte for each
constexpr int length_lanes = 32;  ///< lanes of a row of 32-bit lengths
constexpr int sum_slots = 16;     ///< doubles of a row of sums
constexpr int mask_words = lanes / 64;
constexpr int spare_links = 8;  ///< room that lists of links have beyond their ends

/// Which sum stands where in a row; moments about the origin that the kernel is given.
enum Slot {
  slot_count,
  slot_x,
  slot_y,
  slot_z,
  slot_defect,
  slot_xx,
  slot_xy,
  slot_xz,
  slot_yy,
  slot_yz,
  slot_zz,
  slot_area,
  slot_triangles,
  slot_euler
};

/// Area and number of the triangles whose last corner is a vertex, and 1 - edges + triangles that end there.
struct OwnCells {
  double area_m2;
  int triangles, euler;
};

/// A region's vertices 0 .. size - 1; the first `patch` are the sources. Neighbours of i in `near`:
/// [start, middle) come before i, [middle, outer) after i in the same ring, [outer, next start) in later
/// rings.
struct RegionView {
  int size, patch, rings;
  const int *ring_start, *start, *middle, *outer, *near;
  const std::uint32_t* weight;  ///< of each entry of `near`, for rows of lengths
};

/// What a region may grow into: links of a mesh's vertices (by rank), `neighbour` as in LinkInput, and a
/// vertex `gap` that is no vertex; with `distance`, only those whose distance is not `far`.
struct GrowInput {
  const int *link_start, *neighbour;
  int gap;
  const std::uint32_t* distance;  ///< of each vertex, or null
  static constexpr std::uint32_t far = ~std::uint32_t{0};
};
/// Appends to order[0 .. reached) what the vertices order[head .. end) have for neighbours without a slot,
/// and gives these their slots, 1 + their places; returns how many are reached then. slot[gap] must not be 0,
/// and may change. `order` can be written `spare_links` beyond.
int grow_ring(const GrowInput& input, int* order, int* slot, int head, int end, int reached);

/// How a mesh's vertices (by rank) are linked, and where a region has them: 1 + the place, or 0 outside.
/// `neighbour` and `area_m2` can be read `spare_links` beyond their ends.
struct LinkInput {
  const int *order, *slot, *link_start, *neighbour;
  const double* area_m2;        ///< of the triangle between a link and the next one round the vertex
  const std::uint32_t* weight;  ///< of each link, or null
};
/// What a RegionView needs, and of each vertex its own cells and its last neighbour in the order (beyond all
/// where one is outside or the link has a gap). `near` and `weight` can be written `spare_links` beyond.
struct LinkOutput {
  int *start, *middle, *outer, *near, *farthest;
  std::uint32_t* weight;
  OwnCells* own;
};
/// Splits the neighbours of the vertices [begin, end), a ring, by the order; start[begin] is there.
void split_links(const LinkInput& input, int begin, int end, const LinkOutput& output);

/// rows[128 i + l] = edges between source l and vertex i where these are at most `limit` (254 or less), more
/// than `limit` elsewhere. Exact where the shortest path stays in the region. `dirty`: size bytes of scratch.
/// All pointers to rows aligned to 128.
void hop_rows(const RegionView& region, int limit, std::uint8_t* rows, std::uint8_t* dirty);
/// The same for lengths of up to 32 sources from `first` on; far is 2^31, limit is less.
void length_rows(const RegionView& region, std::uint32_t limit, int first, std::uint32_t* rows,
                 std::uint8_t* dirty);

/// Bit l of masks[2 i ..] says whether row i has a value <= limit at lane l, of the first `size` rows.
void hop_masks(const std::uint8_t* rows, int size, int limit, std::uint64_t* masks);
/// Bits of 32 lanes, into word `word` of each mask of four 32-bit words. `close`: the lanes where any value
/// lies in (limit - slack, limit + slack].
std::uint32_t length_masks(const std::uint32_t* rows, int size, std::uint32_t limit, std::uint32_t slack,
                           int word, std::uint64_t* masks);

struct SumInput {
  int size;
  const int* order;      ///< vertex -> point
  const double* points;  ///< x, y, z, defect of each point
  const OwnCells* own;
  double origin[3];
};
/// One radius' masks: all alike before vertex `inside`, all zero from `end` on.
struct MaskRange {
  const std::uint64_t* masks;
  int inside, end;
};
/// Sums over the vertices of each lane's mask, for `radii` sets of masks: sums[q][l] is a row of `sum_slots`.
/// Abel's way: prefix sums over the order, taken where runs of a mask begin and end.
void lane_sums(const SumInput& input, int radii, const MaskRange* masks, double* sums);

}  // namespace geocage::topology
