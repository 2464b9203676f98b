#include "geometry/distance_field.h"

#include <algorithm>
#include <cmath>

namespace geocage::geometry {

namespace {

/// Where p lies in a lattice of cells: the cell's lower corner and the fractions inside it.
struct Place {
  std::array<int, 3> cell;
  Vec3 fraction;
};

inline Place place_in(const Vec3& q, const std::array<int, 3>& cells) {
  Place place;
  for (int i = 0; i < 3; ++i) {
    place.cell[i] = std::clamp(static_cast<int>(q[i]), 0, cells[i] - 1);
    place.fraction[i] = q[i] - place.cell[i];
  }
  return place;
}

/// The eight nodes around a point, x fastest from `at`, and where it lies between them.
struct Corners {
  const float* at;
  std::ptrdiff_t dy, dz;
  Vec3 fraction;
  bool fine, in_grid;
  Vec3 beyond_m;  ///< from the grid's box to the point, 0 inside
};

inline Corners corners_around(const SignedDistanceField& field, const Vec3& p_O) {
  const std::array<int, 3> cells = {field.nodes[0] - 1, field.nodes[1] - 1, field.nodes[2] - 1};
  const Vec3 wanted = (p_O - field.origin) / field.cell_m;
  const Vec3 inside = wanted.cwiseMax(0).cwiseMin(Vec3(cells[0], cells[1], cells[2]));
  const bool in_grid = wanted == inside;
  const Vec3 beyond_m = (wanted - inside) * field.cell_m;
  const Place place = place_in(inside, cells);
  const auto& [x, y, z] = place.cell;
  const int b = field.block[x + std::ptrdiff_t(cells[0]) * (y + std::ptrdiff_t(cells[1]) * z)];
  if (b < 0) {
    const std::ptrdiff_t dy = field.nodes[0], dz = dy * field.nodes[1];
    return {field.coarse.data() + x + dy * y + dz * z, dy, dz, place.fraction, false, in_grid, beyond_m};
  }
  const int refine = field.refine;
  const std::ptrdiff_t n = refine + 1, n2 = n * n;
  const Place fine = place_in(place.fraction * refine, {refine, refine, refine});
  const auto& c = fine.cell;
  return {field.fine.data() + b * n2 * n + c[0] + n * c[1] + n2 * c[2],
          n,
          n2,
          fine.fraction,
          true,
          in_grid,
          beyond_m};
}

/// Trilinear value; with a gradient (per cell) where one is asked for. The value is the same to the bit.
template <bool with_gradient>
inline double interpolate(const Corners& corners, Vec3* gradient) {
  const float* at = corners.at;
  const std::ptrdiff_t dy = corners.dy, dz = corners.dz;
  const Vec3& f = corners.fraction;
  const double c000 = at[0], c100 = at[1], c010 = at[dy], c110 = at[dy + 1];
  const double c001 = at[dz], c101 = at[dz + 1], c011 = at[dz + dy], c111 = at[dz + dy + 1];
  const double x00 = c000 + f.x() * (c100 - c000), x10 = c010 + f.x() * (c110 - c010);
  const double x01 = c001 + f.x() * (c101 - c001), x11 = c011 + f.x() * (c111 - c011);
  const double xy0 = x00 + f.y() * (x10 - x00), xy1 = x01 + f.y() * (x11 - x01);
  if constexpr (with_gradient) {
    const double gx0 = (c100 - c000) + f.y() * ((c110 - c010) - (c100 - c000));
    const double gx1 = (c101 - c001) + f.y() * ((c111 - c011) - (c101 - c001));
    *gradient = {gx0 + f.z() * (gx1 - gx0), (x10 - x00) + f.z() * ((x11 - x01) - (x10 - x00)), xy1 - xy0};
  }
  return xy0 + f.z() * (xy1 - xy0);
}

}  // namespace

double SignedDistanceField::value(const Vec3& p_O) const {
  const Corners corners = corners_around(*this, p_O);
  const double distance = interpolate<false>(corners, nullptr);
  return corners.in_grid ? distance : distance + corners.beyond_m.norm();
}

double SignedDistanceField::value(const Vec3& p_O, Vec3& gradient) const {
  const Corners corners = corners_around(*this, p_O);
  const double distance = interpolate<true>(corners, &gradient);
  if (corners.fine)
    gradient *= refine / cell_m;
  else
    gradient /= cell_m;
  if (corners.in_grid) return distance;
  const double away = corners.beyond_m.norm();
  if (away == 0) return distance;  // less than a double can square
  for (int i = 0; i < 3; ++i)
    if (corners.beyond_m[i] != 0) gradient[i] = corners.beyond_m[i] / away;
  return distance + away;
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
