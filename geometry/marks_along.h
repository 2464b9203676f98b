#pragma once

namespace geocage::geometry {

/// Plain numbers of a grid of cells, since what follows is compiled once for each instruction set.
struct GridSize {
  double origin[3], cell;
  int nodes[3];
};

/// Where the mark of a cell lies among all of the grid: they are kept in bricks of 4 x 4 x 4 cells.
inline int mark_index(const int* nodes, int x, int y, int z) {
  const int nx = (nodes[0] + 2) >> 2, ny = (nodes[1] + 2) >> 2;
  return 64 * ((x >> 2) + nx * ((y >> 2) + ny * (z >> 2))) + (x & 3) + 4 * (y & 3) + 16 * (z & 3);
}

/// Of the points a + i / last * ab, i = 0 ... last: where the mark of its cell lies, or of the nearest cell
/// for a point outside. Writes up to seven numbers more. The same with every instruction set.
void marks_along(const GridSize& grid, const double* a, const double* ab, int last, int* index);

}  // namespace geocage::geometry
