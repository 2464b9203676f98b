#include <algorithm>
#include <cmath>

#include "geometry/distance_field.h"
#include "geometry/nearest_of_eight.h"
#include "geometry/surface_distance.h"
#include "pipeline/error.h"

namespace geocage::geometry {

namespace {

constexpr int most_parts = 15;  // four bits
constexpr int first_parts = 5;  // at most, of a block that tells how many it needs
constexpr int most_looks = 2;   // at blocks of a cell
constexpr std::size_t most_fine_nodes = std::size_t(1) << 28;  // the others of 32

/// A box of lattice nodes, x fastest.
struct Lattice {
  Vec3 origin;
  double step_m;
  std::array<int, 3> nodes;

  std::ptrdiff_t size() const { return std::ptrdiff_t(nodes[0]) * nodes[1] * nodes[2]; }
  Vec3 at(int x, int y, int z) const { return origin + step_m * Vec3(x, y, z); }
  std::ptrdiff_t index(int x, int y, int z) const {
    return x + std::ptrdiff_t(nodes[0]) * (y + std::ptrdiff_t(nodes[1]) * z);
  }
};

/// Gives the nodes of a lattice their signs. Two neighbours whose distances add up to more than the step
/// between them can't have the surface between them: signs flood over such edges, and rays decide one node of
/// each flooded part. `sign` holds 0 where it is not known yet.
void flood_signs(const SurfaceDistance& surface, const Lattice& lattice, const float* distance,
                 std::vector<signed char>& sign) {
  std::vector<std::ptrdiff_t> front;
  const std::ptrdiff_t dy = lattice.nodes[0], dz = dy * lattice.nodes[1];
  const auto flood = [&] {
    while (!front.empty()) {
      const std::ptrdiff_t i = front.back();
      front.pop_back();
      const std::array<std::ptrdiff_t, 3> at = {i % dy, i / dy % lattice.nodes[1], i / dz},
                                          stride = {1, dy, dz};
      for (int axis = 0; axis < 3; ++axis)
        for (int step : {-1, 1}) {
          if (at[axis] + step < 0 || at[axis] + step >= lattice.nodes[axis]) continue;
          const std::ptrdiff_t j = i + step * stride[axis];
          if (sign[j] != 0 || distance[i] + distance[j] <= lattice.step_m * (1 + 1e-5)) continue;
          sign[j] = sign[i];
          front.push_back(j);
        }
    }
  };
  for (std::ptrdiff_t i = 0; i < lattice.size(); ++i)
    if (sign[i] != 0) front.push_back(i);
  flood();
  for (int z = 0; z < lattice.nodes[2]; ++z)
    for (int y = 0; y < lattice.nodes[1]; ++y)
      for (int x = 0; x < lattice.nodes[0]; ++x) {
        const std::ptrdiff_t i = lattice.index(x, y, z);
        if (sign[i] != 0) continue;
        sign[i] = surface.inside(lattice.at(x, y, z)) ? -1 : 1;
        front.push_back(i);
        flood();
      }
}

/// Signed distances of a lattice's nodes, and the triangles that they are distances to.
struct Measured {
  std::vector<float> values;
  std::vector<int> nearest;

  explicit Measured(const Lattice& lattice)
      : values(static_cast<std::size_t>(lattice.size())), nearest(values.size()) {}
  void give_signs(const SurfaceDistance& surface, const Lattice& lattice, std::vector<signed char> known) {
    flood_signs(surface, lattice, values.data(), known);
    for (std::size_t i = 0; i < values.size(); ++i) values[i] *= known[i];
  }
};

/// Unsigned distances of two layers of nodes, in twos along each axis; each search starts from what was
/// nearest to its neighbours along x and y, the first from `guess`.
void measure_layers(const NearestOfEight& search, const Lattice& lattice, int z, int guess,
                    Measured& measured) {
  NearestOfEight::Points eight;
  std::array<std::ptrdiff_t, 8> node, before;
  const auto& nodes = lattice.nodes;
  for (int y = 0; y < lattice.nodes[1]; y += 2)
    for (int x = 0; x < lattice.nodes[0]; x += 2) {
      for (int k = 0; k < 8; ++k) {
        const int at_x = std::min(x + (k & 1), nodes[0] - 1), at_y = std::min(y + (k >> 1 & 1), nodes[1] - 1),
                  at_z = std::min(z + (k >> 2), nodes[2] - 1);
        node[k] = lattice.index(at_x, at_y, at_z);
        before[k] = lattice.index(x - 1, at_y, at_z);
        eight.points_O[k] = lattice.at(at_x, at_y, at_z);
      }
      if (x == 0) {
        eight.nearest.fill(y > 0 ? measured.nearest[lattice.index(0, y - 1, z)] : guess);
      } else {
        for (int k = 0; k < 8; ++k) eight.nearest[k] = measured.nearest[before[k]];
      }
      search.measure(eight);
      for (int k = 0; k < 8; ++k) {
        measured.values[node[k]] = static_cast<float>(eight.distance_m[k]);
        measured.nearest[node[k]] = eight.nearest[k];
      }
    }
}

Measured measure_coarse(const SurfaceDistance& surface, const NearestOfEight& search,
                        const Lattice& lattice) {
  Measured measured(lattice);
#pragma omp parallel for schedule(dynamic, 1)
  for (int z = 0; z < lattice.nodes[2]; z += 2) measure_layers(search, lattice, z, 0, measured);
  measured.give_signs(surface, lattice, std::vector<signed char>(measured.values.size(), 0));
  return measured;
}

std::array<float, 8> corners_of(const Lattice& lattice, const std::vector<float>& values, int x, int y,
                                int z) {
  std::array<float, 8> corners;
  for (int c = 0; c < 8; ++c) corners[c] = values[lattice.index(x + (c & 1), y + (c >> 1 & 1), z + (c >> 2))];
  return corners;
}

/// The surface crosses a cell only if it comes as near as half the diagonal to one corner and as the diagonal
/// to all.
bool may_be_crossed(const std::array<float, 8>& corners, double cell_m) {
  const double diagonal = std::sqrt(3.0) * cell_m * (1 + 1e-5);
  double least = diagonal, most = 0;
  for (float d : corners) {
    least = std::min<double>(least, std::abs(d));
    most = std::max<double>(most, std::abs(d));
  }
  return least <= diagonal / 2 && most <= diagonal;
}

/// The block of a coarse cell; its corners keep the coarse nodes' signs.
Measured measure_block(const SurfaceDistance& surface, const NearestOfEight& search, const Lattice& block,
                       const std::array<float, 8>& corners, int guess) {
  const int n = block.nodes[0];
  Measured measured(block);
  for (int z = 0; z < n; z += 2)
    measure_layers(search, block, z, z == 0 ? guess : measured.nearest[block.index(0, 0, z - 1)], measured);
  std::vector<signed char> sign(measured.values.size(), 0);
  for (int c = 0; c < 8; ++c)
    sign[block.index((c & 1) * (n - 1), (c >> 1 & 1) * (n - 1), (c >> 2) * (n - 1))] =
        corners[c] < 0 ? -1 : 1;
  measured.give_signs(surface, block, std::move(sign));
  return measured;
}

/// How much interpolation errs in a cell, told from distances and gradients at its corners. Along an edge
/// with chord slope c and end slopes a and b, two straight lines meet l |a-c| |c-b| / (|a-c| + |c-b|) off the
/// chord: the error at a ridge between two walls, and twice that of a parabola. Edges along the three axes
/// add up.
struct Bend {
  double ridge_m = 0;  ///< where slopes of the distance to the surface fall; halves with the cell's side
  double round_m = 0;  ///< where they rise, as in front of an edge or a corner; quarters with it

  /// By how much the cell's side must be shorter for this to come down to `error_m`.
  double finer(double error_m, bool crossed) const {
    const double ridges = ridge_m / error_m, rounds = round_m / error_m;
    // At the surface itself a corner stays a corner however near one looks.
    return std::max({1.0, ridges, crossed ? rounds : std::sqrt(rounds)});
  }
};

/// How far interpolation errs along an edge, from its ends' values and slopes (Bend).
double off_edge_m(double value_a, double value_b, double slope_a, double slope_b, double side_m) {
  const double chord = (value_b - value_a) / side_m;
  const double at_a = std::abs(slope_a - chord), at_b = std::abs(chord - slope_b);
  return at_a + at_b > 0 ? side_m * at_a * at_b / (at_a + at_b) : 0;
}

int parts_of(double finer) {
  return static_cast<int>(std::ceil(std::clamp<double>(finer, 1, most_parts)));
}

/// Which cells are too coarse.
class Judge {
 public:
  Judge(const SurfaceDistance& surface, const NearestOfEight& search, const FieldGrid& grid)
      : surface_(surface), search_(search), grid_(grid) {
    const auto [least, most] = std::minmax(grid.error_m, grid.inside_error_m);
    asked_m_ = least > 0 ? least : most;
  }

  /// Parts along a cell of a lattice, whose corner nearest to the origin is (x, y, z): 1 when it is fine as
  /// it is; what corners tell is capped, since a block tells it better.
  int parts(const Lattice& lattice, const Measured& measured, int x, int y, int z, bool crossed) const {
    if (nothing_asked()) return 1;
    const auto corners = corners_of(lattice, measured.values, x, y, z);
    if (!matters(corners, lattice.step_m)) return 1;
    std::array<Vec3, 8> slopes;
    for (int c = 0; c < 8; ++c)
      slopes[c] = slope(lattice, measured, x + (c & 1), y + (c >> 1 & 1), z + (c >> 2));
    const int told = std::min(parts_of(finer(corners, slopes, lattice.step_m, crossed)), first_parts);
    return told > 1 || crossed ? told
                               : looked(lattice, corners, x, y, z, measured.nearest[lattice.index(x, y, z)]);
  }
  /// By how much the cells of a block must be finer; 1 when they are fine as they are.
  double finer(const Lattice& block, const Measured& measured) const {
    if (nothing_asked()) return 1;
    std::vector<Vec3> slopes(measured.values.size());
    for (int z = 0; z < block.nodes[2]; ++z)
      for (int y = 0; y < block.nodes[1]; ++y)
        for (int x = 0; x < block.nodes[0]; ++x)
          slopes[block.index(x, y, z)] = slope(block, measured, x, y, z);
    const std::vector<Vec3> off_m = off_edges_m(block, measured.values, slopes);
    double most = 1;
    for (int z = 0; z + 1 < block.nodes[2]; ++z)
      for (int y = 0; y + 1 < block.nodes[1]; ++y)
        for (int x = 0; x + 1 < block.nodes[0]; ++x) {
          if (off_cell_m(block, off_m, block.index(x, y, z)) <= asked_m_) continue;
          const auto corners = corners_of(block, measured.values, x, y, z);
          if (!matters(corners, block.step_m)) continue;
          std::array<Vec3, 8> around;
          for (int c = 0; c < 8; ++c)
            around[c] = slopes[block.index(x + (c & 1), y + (c >> 1 & 1), z + (c >> 2))];
          most = std::max(most, finer(corners, around, block.step_m, may_be_crossed(corners, block.step_m)));
        }
    return most;
  }

 private:
  bool nothing_asked() const { return grid_.error_m <= 0 && grid_.inside_error_m <= 0; }
  /// Whether points of the cell are near, on a side that is asked for.
  bool matters(const std::array<float, 8>& corners, double side_m) const {
    const auto [least, most] = std::minmax_element(corners.begin(), corners.end());
    const double near_m = grid_.near_m + side_m / 2;
    return (grid_.error_m > 0 && *most > 0 && *least <= near_m) ||
           (grid_.inside_error_m > 0 && *least < 0 && *most >= -near_m);
  }
  double finer(const std::array<float, 8>& corners, const std::array<Vec3, 8>& slopes, double side_m,
               bool crossed) const {
    const auto [low, high] = std::minmax_element(corners.begin(), corners.end());
    double most = 1;
    if (grid_.error_m > 0 && *high > 0)
      most = bend(corners, slopes, side_m, false).finer(grid_.error_m, crossed);
    if (grid_.inside_error_m > 0 && *low < 0)
      most = std::max(most, bend(corners, slopes, side_m, true).finer(grid_.inside_error_m, crossed));
    return most;
  }

  /// Parts along a cell that the surface does not cross, by the error in its middle and amid its faces: a
  /// ridge along a diagonal leaves corners as if there were none.
  int looked(const Lattice& lattice, const std::array<float, 8>& corners, int x, int y, int z,
             int guess) const {
    const bool inside = corners[0] < 0;
    const double asked_m = inside ? grid_.inside_error_m : grid_.error_m;
    if (asked_m <= 0) return 1;
    NearestOfEight::Points points;
    points.nearest.fill(guess);
    std::array<double, 8> between{};
    for (int k = 0; k < 8; ++k) {  // the middle is the seventh, and the eighth
      Vec3 at = Vec3::Constant(0.5);
      if (k < 6) at[k / 2] = k % 2;
      points.points_O[k] = lattice.at(x, y, z) + lattice.step_m * at;
      for (int c = 0; c < 8; ++c) {
        double weight = corners[c];
        for (int axis = 0; axis < 3; ++axis) weight *= c >> axis & 1 ? at[axis] : 1 - at[axis];
        between[k] += weight;
      }
    }
    search_.measure(points);
    double off_m = 0;
    for (int k = 0; k < 8; ++k)
      off_m = std::max(off_m, std::abs(std::abs(between[k]) - points.distance_m[k]));
    return parts_of(off_m / asked_m);
  }

  /// Gradient of the signed distance at a node.
  Vec3 slope(const Lattice& lattice, const Measured& measured, int x, int y, int z) const {
    const std::ptrdiff_t i = lattice.index(x, y, z);
    const Vec3 p_O = lattice.at(x, y, z);
    const int nearest = measured.nearest[i];
    const Vec3 away = p_O - surface_.nearest_point(p_O, nearest);
    const double length = away.norm();
    if (length > 1e-9) return away * ((measured.values[i] < 0 ? -1 : 1) / length);
    const Vec3& normal = surface_.normal(nearest);
    return normal.allFinite() ? normal : Vec3::Zero();
  }

  /// How far interpolation errs along the three edges that begin at each node of a block.
  static std::vector<Vec3> off_edges_m(const Lattice& block, const std::vector<float>& values,
                                       const std::vector<Vec3>& slopes) {
    std::vector<Vec3> off_m(values.size(), Vec3::Zero());
    const std::array<std::ptrdiff_t, 3> next = {1, block.index(0, 1, 0), block.index(0, 0, 1)};
    for (int z = 0; z < block.nodes[2]; ++z)
      for (int y = 0; y < block.nodes[1]; ++y)
        for (int x = 0; x < block.nodes[0]; ++x) {
          const std::array<int, 3> at = {x, y, z};
          const std::ptrdiff_t i = block.index(x, y, z);
          for (int axis = 0; axis < 3; ++axis)
            if (const std::ptrdiff_t j = i + next[axis]; at[axis] + 1 < block.nodes[axis])
              off_m[i][axis] =
                  off_edge_m(values[i], values[j], slopes[i][axis], slopes[j][axis], block.step_m);
        }
    return off_m;
  }
  /// The same in the cell whose first node is i, whatever its edges' side and kind: no less than its bends.
  static double off_cell_m(const Lattice& block, const std::vector<Vec3>& off_m, std::ptrdiff_t i) {
    const std::array<std::ptrdiff_t, 3> next = {1, block.index(0, 1, 0), block.index(0, 0, 1)};
    double sum_m = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const std::ptrdiff_t a = next[(axis + 1) % 3], b = next[(axis + 2) % 3];
      sum_m += std::max(std::max(off_m[i][axis], off_m[i + a][axis]),
                        std::max(off_m[i + b][axis], off_m[i + a + b][axis]));
    }
    return sum_m;
  }

  /// Of the edges that are inside, or of the others.
  static Bend bend(const std::array<float, 8>& corners, const std::array<Vec3, 8>& slopes, double side_m,
                   bool inside) {
    Bend bend;
    for (int axis = 0; axis < 3; ++axis) {
      double ridge_m = 0, round_m = 0;
      for (int c = 0; c < 8; ++c) {
        if (c >> axis & 1) continue;
        const int d = c | 1 << axis;
        if ((corners[c] <= 0 && corners[d] <= 0) != inside) continue;
        const double off_m = off_edge_m(corners[c], corners[d], slopes[c][axis], slopes[d][axis], side_m);
        const bool falls = slopes[c][axis] > slopes[d][axis];  // of the signed distance
        double& most = falls != inside ? ridge_m : round_m;
        most = std::max(most, off_m);
      }
      bend.ridge_m += ridge_m;
      bend.round_m += round_m;
    }
    return bend;
  }

  const SurfaceDistance& surface_;
  const NearestOfEight& search_;
  const FieldGrid& grid_;
  double asked_m_;  ///< the least error that is asked for on a side
};

/// A coarse cell that is parted.
struct Parted {
  std::array<int, 3> at;
  int parts;
};

/// A block's values, of `parts` along the cell, or of as many more as the block shows it needs, and the next.
std::vector<float> measure_parted(const SurfaceDistance& surface, const NearestOfEight& search,
                                  const Judge& judge, const Lattice& coarse, const Measured& measured,
                                  Parted& cell) {
  const auto [x, y, z] = cell.at;
  const auto corners = corners_of(coarse, measured.values, x, y, z);
  for (int looks = 0;; ++looks) {
    const int n = cell.parts + 1;
    const Lattice block{coarse.at(x, y, z), coarse.step_m / cell.parts, {n, n, n}};
    Measured fine = measure_block(surface, search, block, corners, measured.nearest[coarse.index(x, y, z)]);
    if (looks == most_looks || cell.parts == most_parts) return std::move(fine.values);
    const double finer = judge.finer(block, fine);
    if (finer == 1) return std::move(fine.values);
    cell.parts = parts_of(cell.parts * finer);
  }
}

}  // namespace

SignedDistanceField build_distance_field(const TriangleMesh& mesh, const FieldGrid& grid) {
  const MeshReport report = check_mesh(mesh);
  const Vec3 low = report.box_min - Vec3::Constant(grid.pad_m),
             size = report.box_max + Vec3::Constant(grid.pad_m) - low;
  SignedDistanceField field;
  field.cell_m = size.maxCoeff() / grid.cells;
  field.origin = low;
  for (int i = 0; i < 3; ++i) field.nodes[i] = static_cast<int>(std::ceil(size[i] / field.cell_m - 1e-9)) + 1;

  const SurfaceDistance surface(mesh);
  const NearestOfEight search(mesh);
  const Judge judge(surface, search, grid);
  const Lattice coarse{field.origin, field.cell_m, field.nodes};
  Measured measured = measure_coarse(surface, search, coarse);

  const std::array<int, 3> cells = {field.nodes[0] - 1, field.nodes[1] - 1, field.nodes[2] - 1};
  std::vector<std::vector<Parted>> of_layer(static_cast<std::size_t>(cells[2]));
#pragma omp parallel for schedule(dynamic, 1)
  for (int z = 0; z < cells[2]; ++z)
    for (int y = 0; y < cells[1]; ++y)
      for (int x = 0; x < cells[0]; ++x) {
        const bool crossed = may_be_crossed(corners_of(coarse, measured.values, x, y, z), field.cell_m);
        const int parts =
            std::max(crossed ? grid.refine : 1, judge.parts(coarse, measured, x, y, z, crossed));
        if (crossed || parts > 1) of_layer[static_cast<std::size_t>(z)].push_back({{x, y, z}, parts});
      }
  std::vector<Parted> parted;
  for (const auto& layer : of_layer) parted.insert(parted.end(), layer.begin(), layer.end());

  std::vector<std::vector<float>> blocks(parted.size());
#pragma omp parallel for schedule(dynamic, 64)
  for (std::size_t b = 0; b < parted.size(); ++b)
    blocks[b] = measure_parted(surface, search, judge, coarse, measured, parted[b]);

  std::size_t nodes = 0;
  for (const auto& block : blocks) nodes += block.size();
  if (nodes >= most_fine_nodes)
    throw pipeline::UserError(pipeline::Fault::geometry, "field",
                              "its blocks have " + std::to_string(nodes) + " nodes, and can have 2^28",
                              "fewer cells, a smaller refine, or a larger error_m");
  field.coarse = std::move(measured.values);
  field.block.assign(std::size_t(cells[0]) * cells[1] * cells[2], 0);
  field.fine.reserve(nodes);
  for (std::size_t b = 0; b < parted.size(); ++b) {
    const auto [x, y, z] = parted[b].at;
    field.block[x + std::size_t(cells[0]) * (y + std::size_t(cells[1]) * z)] =
        static_cast<std::uint32_t>(16 * field.fine.size() + static_cast<std::size_t>(parted[b].parts));
    field.fine.insert(field.fine.end(), blocks[b].begin(), blocks[b].end());
  }
  field.mark();
  return field;
}

}  // namespace geocage::geometry
