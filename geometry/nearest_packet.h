#pragma once
#include <cstdint>

namespace geocage::geometry {

/// Plain numbers, since the searches below are compiled once for each instruction set.

/// A box of a tree around triangles, in its own axes.
struct TurnedBox {
  double axes[9];  ///< three unit vectors
  double middle[3], half[3];
  int next;   ///< the second child, the first follows; or a leaf's first place
  int count;  ///< of a leaf's triangles, else 0
};

/// A triangle in its own frame: the origin in its first corner, x along its longest side to the second, z
/// normal to it, and the third corner at y >= 0. One without area is its longest side.
struct FlatTriangle {
  double origin[3], axes[9];
  double length;     ///< of the first side
  double second[3];  ///< direction from the first corner to the third, and length
  double third[3];   ///< from the second to the third
};

/// Eight points that search together.
struct alignas(64) Packet {
  static constexpr int size = 8;
  double x[size], y[size], z[size];
  double least2[size];         ///< squared distance of the nearest triangle so far
  std::int64_t nearest[size];  ///< its place
};

/// Measures one more triangle.
void measure_place(const FlatTriangle* triangles, int place, Packet& packet);
/// Measures all triangles that may be nearer than `least2`. `boxes` is the tree's root. The same bits with
/// every instruction set.
void measure_nearest(const TurnedBox* boxes, const FlatTriangle* triangles, Packet& packet);

}  // namespace geocage::geometry
