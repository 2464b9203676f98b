#include <algorithm>
#include <cmath>

#include "geometry/distance_field.h"
#include "geometry/surface_distance.h"

namespace geocage::geometry {

namespace {

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

/// Unsigned distances of one layer of nodes, each search starting from the nearest triangle of the node
/// before.
void measure_layer(const SurfaceDistance& surface, const Lattice& lattice, int z, int& nearest,
                   float* values) {
  for (int y = 0; y < lattice.nodes[1]; ++y)
    for (int x = 0; x < lattice.nodes[0]; ++x)
      values[lattice.index(x, y, z)] = static_cast<float>(surface.distance_m(lattice.at(x, y, z), nearest));
}

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

void measure_coarse(const SurfaceDistance& surface, const Lattice& lattice, std::vector<float>& values) {
  values.resize(static_cast<std::size_t>(lattice.size()));
#pragma omp parallel for schedule(dynamic, 1)
  for (int z = 0; z < lattice.nodes[2]; ++z) {
    int nearest = 0;
    measure_layer(surface, lattice, z, nearest, values.data());
  }
  std::vector<signed char> sign(values.size(), 0);
  flood_signs(surface, lattice, values.data(), sign);
  for (std::size_t i = 0; i < values.size(); ++i) values[i] *= sign[i];
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

/// The (refine + 1)^3 nodes inside one coarse cell; corners keep the coarse nodes' signs.
void measure_block(const SurfaceDistance& surface, const Lattice& block, const std::array<float, 8>& corners,
                   float* values) {
  const int n = block.nodes[0];
  int nearest = 0;
  for (int z = 0; z < n; ++z) measure_layer(surface, block, z, nearest, values);
  std::vector<signed char> sign(static_cast<std::size_t>(block.size()), 0);
  for (int c = 0; c < 8; ++c)
    sign[block.index((c & 1) * (n - 1), (c >> 1 & 1) * (n - 1), (c >> 2) * (n - 1))] =
        corners[c] < 0 ? -1 : 1;
  flood_signs(surface, block, values, sign);
  for (std::ptrdiff_t i = 0; i < block.size(); ++i) values[i] *= sign[i];
}

}  // namespace

SignedDistanceField build_distance_field(const TriangleMesh& mesh, const FieldGrid& grid) {
  const MeshReport report = check_mesh(mesh);
  const Vec3 low = report.box_min - Vec3::Constant(grid.pad_m),
             size = report.box_max + Vec3::Constant(grid.pad_m) - low;
  SignedDistanceField field;
  field.cell_m = size.maxCoeff() / grid.cells;
  field.origin = low;
  field.refine = grid.refine;
  for (int i = 0; i < 3; ++i) field.nodes[i] = static_cast<int>(std::ceil(size[i] / field.cell_m - 1e-9)) + 1;

  const SurfaceDistance surface(mesh);
  const Lattice coarse{field.origin, field.cell_m, field.nodes};
  measure_coarse(surface, coarse, field.coarse);

  const std::array<int, 3> cells = {field.nodes[0] - 1, field.nodes[1] - 1, field.nodes[2] - 1};
  std::vector<std::array<int, 3>> refined;
  field.block.assign(std::size_t(cells[0]) * cells[1] * cells[2], -1);
  for (int z = 0, cell = 0; z < cells[2]; ++z)
    for (int y = 0; y < cells[1]; ++y)
      for (int x = 0; x < cells[0]; ++x, ++cell) {
        if (!may_be_crossed(corners_of(coarse, field.coarse, x, y, z), field.cell_m)) continue;
        field.block[cell] = static_cast<int>(refined.size());
        refined.push_back({x, y, z});
      }

  const int n = grid.refine + 1;
  const std::ptrdiff_t block_size = std::ptrdiff_t(n) * n * n;
  field.fine.resize(refined.size() * static_cast<std::size_t>(block_size));
#pragma omp parallel for schedule(dynamic, 64)
  for (std::size_t b = 0; b < refined.size(); ++b) {
    const auto& [x, y, z] = refined[b];
    std::array<float, 8> corners;
    for (int c = 0; c < 8; ++c)
      corners[c] = field.coarse[coarse.index(x + (c & 1), y + (c >> 1 & 1), z + (c >> 2))];
    const Lattice block{coarse.at(x, y, z), field.cell_m / grid.refine, {n, n, n}};
    measure_block(surface, block, corners, field.fine.data() + std::ptrdiff_t(b) * block_size);
  }
  return field;
}

}  // namespace geocage::geometry
