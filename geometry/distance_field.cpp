#include "geometry/distance_field.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "geometry/marks_along.h"

namespace geocage::geometry {

namespace {

/// Where a coordinate lies among `cells` cells of size 1: the cell's lower end and the fraction inside it.
struct Place {
  int cell;
  double fraction;
};
inline Place place_in(double q, int cells) {
  const int cell = std::clamp(static_cast<int>(q), 0, cells - 1);
  return {cell, q - cell};
}

/// The eight nodes around a point, x fastest from `at`, and where it lies between them. Plain numbers:
/// vectors filled one by one and read as a whole make the processor wait.
struct Corners {
  const float* at;
  std::ptrdiff_t dy, dz;
  double fx, fy, fz;
  int parts;  ///< fine cells along the coarse one
  bool in_grid;
};

/// p in cells of the grid, along axis i.
inline double in_cells(const SignedDistanceField& field, const Vec3& p_O, int i) {
  return (p_O[i] - field.origin[i]) / field.cell_m;
}
inline double in_box(const SignedDistanceField& field, double wanted, int i) {
  return std::min(std::max(wanted, 0.0), double(field.nodes[i] - 1));
}

/// The coarse cell around a point.
struct CoarseCell {
  Place x, y, z;
  std::ptrdiff_t nx, ny;
  bool in_grid;
  std::ptrdiff_t index() const { return x.cell + (nx - 1) * (y.cell + (ny - 1) * z.cell); }
};

[[gnu::always_inline]] inline CoarseCell cell_around(const SignedDistanceField& field, const Vec3& p_O) {
  const double x = in_cells(field, p_O, 0), y = in_cells(field, p_O, 1), z = in_cells(field, p_O, 2);
  const double qx = in_box(field, x, 0), qy = in_box(field, y, 1), qz = in_box(field, z, 2);
  return {place_in(qx, field.nodes[0] - 1),
          place_in(qy, field.nodes[1] - 1),
          place_in(qz, field.nodes[2] - 1),
          field.nodes[0],
          field.nodes[1],
          x == qx && y == qy && z == qz};
}

[[gnu::always_inline]] inline Corners coarse_corners(const SignedDistanceField& field,
                                                     const CoarseCell& cell) {
  const float* at = field.coarse.data() + cell.x.cell + cell.nx * (cell.y.cell + cell.ny * cell.z.cell);
  return {at, cell.nx, cell.nx * cell.ny, cell.x.fraction, cell.y.fraction, cell.z.fraction, 1, cell.in_grid};
}

[[gnu::always_inline]] inline Corners fine_corners(const SignedDistanceField& field, const CoarseCell& cell,
                                                   std::uint32_t block) {
  const int parts = static_cast<int>(block & 15);
  const std::ptrdiff_t n = parts + 1;
  const Place fx = place_in(cell.x.fraction * parts, parts), fy = place_in(cell.y.fraction * parts, parts),
              fz = place_in(cell.z.fraction * parts, parts);
  const float* at = field.fine.data() + (block >> 4) + fx.cell + n * (fy.cell + n * fz.cell);
  return {at, n, n * n, fx.fraction, fy.fraction, fz.fraction, parts, cell.in_grid};
}

[[gnu::always_inline]] inline Corners corners_around(const SignedDistanceField& field, const Vec3& p_O) {
  const CoarseCell cell = cell_around(field, p_O);
  if (!field.marks.empty() &&
      (field.marks[mark_index(field.nodes.data(), cell.x.cell, cell.y.cell, cell.z.cell)] & 1) == 0)
    return coarse_corners(field, cell);
  const std::uint32_t block = field.block[cell.index()];
  return block == 0 ? coarse_corners(field, cell) : fine_corners(field, cell, block);
}

/// From the grid's box to the point.
Vec3 beyond_m(const SignedDistanceField& field, const Vec3& p_O) {
  Vec3 beyond;
  for (int i = 0; i < 3; ++i) {
    const double wanted = in_cells(field, p_O, i);
    beyond[i] = (wanted - in_box(field, wanted, i)) * field.cell_m;
  }
  return beyond;
}

/// Trilinear value; with a gradient (per cell) where one is asked for. The value is the same to the bit.
template <bool with_gradient>
inline double interpolate(const Corners& corners, Vec3* gradient) {
  const auto [at, dy, dz, fx, fy, fz, parts, in_grid] = corners;
  const double c000 = at[0], c100 = at[1], c010 = at[dy], c110 = at[dy + 1];
  const double c001 = at[dz], c101 = at[dz + 1], c011 = at[dz + dy], c111 = at[dz + dy + 1];
  const double x00 = c000 + fx * (c100 - c000), x10 = c010 + fx * (c110 - c010);
  const double x01 = c001 + fx * (c101 - c001), x11 = c011 + fx * (c111 - c011);
  const double xy0 = x00 + fy * (x10 - x00), xy1 = x01 + fy * (x11 - x01);
  if constexpr (with_gradient) {
    const double gx0 = (c100 - c000) + fy * ((c110 - c010) - (c100 - c000));
    const double gx1 = (c101 - c001) + fy * ((c111 - c011) - (c101 - c001));
    *gradient = {gx0 + fz * (gx1 - gx0), (x10 - x00) + fz * ((x11 - x01) - (x10 - x00)), xy1 - xy0};
  }
  return xy0 + fz * (xy1 - xy0);
}

}  // namespace

double SignedDistanceField::value(const Vec3& p_O) const {
  const Corners corners = corners_around(*this, p_O);
  const double distance = interpolate<false>(corners, nullptr);
  return corners.in_grid ? distance : distance + beyond_m(*this, p_O).norm();
}

void SignedDistanceField::bounds_along(const Vec3& a_O, const Vec3& ab_O, int last,
                                       std::array<float, 128>& bound_m) const {
  if (marks.empty()) return bound_m.fill(-std::numeric_limits<float>::infinity());
  const GridSize grid{{origin[0], origin[1], origin[2]}, cell_m, {nodes[0], nodes[1], nodes[2]}};
  std::array<int, 128> index;
  marks_along(grid, a_O.data(), ab_O.data(), last, index.data());
  const float quarter = static_cast<float>(0.25 * cell_m);
  for (int i = 0; i <= last; ++i) bound_m[i] = quarter * static_cast<float>(marks[index[i]] >> 1);
}

void SignedDistanceField::mark() {
  constexpr double rounding_m = 1e-6;  // of floats up to 32 cells, and of interpolation
  const std::ptrdiff_t nx = nodes[0], ny = nodes[1];
  std::size_t bricks = 1;
  for (const int n : nodes) bricks *= static_cast<std::size_t>((n + 2) >> 2);
  marks.assign(64 * bricks, 0);
  std::size_t cell = 0;
  for (int z = 0; z + 1 < nodes[2]; ++z)
    for (int y = 0; y + 1 < nodes[1]; ++y)
      for (int x = 0; x + 1 < nodes[0]; ++x, ++cell) {
        const float* at = &coarse[x + nx * (y + ny * z)];
        float least = std::min({at[0], at[1], at[nx], at[nx + 1]});
        at += nx * ny;
        least = std::min({least, at[0], at[1], at[nx], at[nx + 1]});
        if (block[cell] != 0) {
          const std::size_t n = (block[cell] & 15) + 1;
          const auto first = fine.begin() + (block[cell] >> 4);
          least = *std::min_element(first, first + static_cast<std::ptrdiff_t>(n * n * n));
        }
        const double quarters = std::clamp((least - rounding_m) / (0.25 * cell_m), 0.0, 127.0);
        marks[mark_index(nodes.data(), x, y, z)] =
            static_cast<std::uint8_t>(2 * static_cast<int>(quarters) + (block[cell] != 0));
      }
}

double SignedDistanceField::value(const Vec3& p_O, Vec3& gradient) const {
  const Corners corners = corners_around(*this, p_O);
  const double distance = interpolate<true>(corners, &gradient);
  gradient *= corners.parts / cell_m;
  if (corners.in_grid) return distance;
  const Vec3 beyond = beyond_m(*this, p_O);
  const double away = beyond.norm();
  if (away == 0) return distance;  // less than a double can square
  for (int i = 0; i < 3; ++i)
    if (beyond[i] != 0) gradient[i] = beyond[i] / away;
  return distance + away;
}

SignedDistanceField::Cell SignedDistanceField::cell_at(const Vec3& p_O) const {
  const Corners corners = corners_around(*this, p_O);
  return {cell_m / corners.parts,
          {corners.fx, corners.fy, corners.fz},
          interpolate<false>(corners, nullptr),
          corners.in_grid ? 0 : beyond_m(*this, p_O).norm()};
}

double SignedDistanceField::finest_cell_m() const {
  std::uint32_t most = 1;
  for (std::uint32_t b : block) most = std::max(most, b & 15);
  return cell_m / most;
}

double brute_force_distance_m(const TriangleMesh& mesh, const Vec3& p) {
  double best = std::numeric_limits<double>::infinity();
  for (const auto& t : mesh.triangles)
    best = std::min(
        best,
        (closest_point_on_triangle(p, mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]) - p)
            .squaredNorm());
  return std::sqrt(best);
}

double winding_number_of_mesh(const TriangleMesh& mesh, const Vec3& p) {
  double solid_angle = 0;  // Van Oosterom and Strackee 1983
  for (const auto& t : mesh.triangles) {
    const Vec3 a = mesh.vertices[t[0]] - p, b = mesh.vertices[t[1]] - p, c = mesh.vertices[t[2]] - p;
    const double la = a.norm(), lb = b.norm(), lc = c.norm();
    solid_angle +=
        2 * std::atan2(a.dot(b.cross(c)), la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
  }
  return solid_angle / (4 * M_PI);
}

Vec3 closest_point_on_triangle(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 ab = b - a, ac = c - a;
  const auto on_edge = [&p](const Vec3& from, const Vec3& along) -> Vec3 {
    const double length2 = along.squaredNorm();
    return from + std::clamp(length2 > 0 ? (p - from).dot(along) / length2 : 0.0, 0.0, 1.0) * along;
  };
  const Vec3 n = ab.cross(ac);
  const double n2 = n.squaredNorm();
  if (n2 > 0) {
    // Barycentric coordinates of the foot of p; inside when none is negative.
    const Vec3 ap = p - a;
    const double v = ap.cross(ac).dot(n), w = ab.cross(ap).dot(n);
    if (v >= 0 && w >= 0 && v + w <= n2) return a + (v * ab + w * ac) / n2;
  }
  Vec3 best = on_edge(a, ab);
  for (const Vec3& q : {on_edge(b, c - b), on_edge(c, -ac)})
    if ((q - p).squaredNorm() < (best - p).squaredNorm()) best = q;
  return best;
}

}  // namespace geocage::geometry
