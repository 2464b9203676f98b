#include "datasets/shapes.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <set>
#include <utility>

#include <fmt/format.h>

#include "pipeline/error.h"

namespace geocage::datasets {

namespace {

using std::numbers::phi;
using std::numbers::pi;
using Triangle = std::array<int, 3>;

/// A point (distance from the axis, height) of a curve that turns around z; outside lies at the curve's
/// right.
struct ProfilePoint {
  double radius_m, z_m;
};
using Profile = std::vector<ProfilePoint>;

/// Vertex ids of a profile point's circle: one id where it touches the axis.
struct Circle {
  int first, count;
  int at(int j) const { return first + j % count; }
};

Circle add_circle(TriangleMesh& mesh, const ProfilePoint& point, int around) {
  const Circle circle{static_cast<int>(mesh.vertices.size()), point.radius_m == 0 ? 1 : around};
  for (int j = 0; j < circle.count; ++j) {
    const double angle = 2 * pi * j / around;
    mesh.vertices.emplace_back(point.radius_m * std::cos(angle), point.radius_m * std::sin(angle), point.z_m);
  }
  return circle;
}

void add_band(TriangleMesh& mesh, const Circle& lower, const Circle& upper, int around) {
  for (int j = 0; j < around; ++j) {
    if (lower.count > 1) mesh.triangles.push_back({lower.at(j), lower.at(j + 1), upper.at(j + 1)});
    if (upper.count > 1) mesh.triangles.push_back({lower.at(j), upper.at(j + 1), upper.at(j)});
  }
}

enum class Ends { apart, joined };

TriangleMesh revolve(const Profile& profile, int around, Ends ends) {
  TriangleMesh mesh;
  std::vector<Circle> circles;
  for (const ProfilePoint& point : profile) circles.push_back(add_circle(mesh, point, around));
  for (std::size_t i = 0; i + 1 < circles.size(); ++i) add_band(mesh, circles[i], circles[i + 1], around);
  if (ends == Ends::joined) add_band(mesh, circles.back(), circles.front(), around);
  return mesh;
}

/// The polygon through `corners` with points at most `spacing_m` apart.
Profile refined(const Profile& corners, double spacing_m) {
  Profile points{corners.front()};
  for (std::size_t i = 0; i + 1 < corners.size(); ++i) {
    const auto [r0, z0] = corners[i];
    const auto [r1, z1] = corners[i + 1];
    const int steps = std::max(1, static_cast<int>(std::ceil(std::hypot(r1 - r0, z1 - z0) / spacing_m)));
    for (int k = 1; k < steps; ++k)
      points.push_back({r0 + (r1 - r0) * k / steps, z0 + (z1 - z0) * k / steps});
    points.push_back(corners[i + 1]);
  }
  return points;
}

double chord_m(double radius_m, int around) {
  return 2 * radius_m * std::sin(pi / around);
}

/// Points of the circle around (0, z) from one angle to another (0: away from the axis, pi / 2: up), without
/// the first; at most `spacing_m` apart.
Profile arc(double z_m, double radius_m, double from, double to, double spacing_m) {
  const int steps = std::max(2, static_cast<int>(std::ceil(std::abs(to - from) * radius_m / spacing_m)));
  Profile points;
  for (int k = 1; k <= steps; ++k) {
    const double angle = from + (to - from) * k / steps;
    const double r = k == steps && std::abs(std::abs(to) - pi / 2) < 1e-12 ? 0 : radius_m * std::cos(angle);
    points.push_back({r, z_m + radius_m * std::sin(angle)});
  }
  return points;
}

void append(Profile& profile, const Profile& more) {
  profile.insert(profile.end(), more.begin(), more.end());
}

/// Straight on to a point, without the last one of `profile`.
void straight_to(Profile& profile, const ProfilePoint& end, double spacing_m) {
  const Profile line = refined({profile.back(), end}, spacing_m);
  profile.insert(profile.end(), line.begin() + 1, line.end());
}

/// Each triangle into four, at the middles of its edges.
TriangleMesh quartered(const TriangleMesh& coarse) {
  TriangleMesh fine{coarse.vertices, {}};
  std::map<std::pair<int, int>, int> middles;
  const auto middle = [&](int a, int b) {
    const auto [entry, fresh] =
        middles.try_emplace(std::minmax(a, b), static_cast<int>(fine.vertices.size()));
    if (fresh) fine.vertices.push_back((fine.vertices[a] + fine.vertices[b]) / 2);
    return entry->second;
  };
  for (const auto& [a, b, c] : coarse.triangles) {
    const int ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
    for (const Triangle& t : {Triangle{a, ab, ca}, {b, bc, ab}, {c, ca, bc}, {ab, bc, ca}})
      fine.triangles.push_back(t);
  }
  return fine;
}

TriangleMesh scaled(TriangleMesh mesh, double factor) {
  for (Vec3& v : mesh.vertices) v *= factor;
  return mesh;
}

/// The surface of a set of unit cells, scaled: each face between a cell and no cell becomes two triangles.
TriangleMesh cell_surface(const std::set<Triangle>& cells, double cell_m) {
  TriangleMesh mesh;
  std::map<Triangle, int> ids;
  const auto vertex = [&](const Triangle& node) {
    const auto [entry, fresh] = ids.try_emplace(node, static_cast<int>(mesh.vertices.size()));
    if (fresh) mesh.vertices.push_back(Vec3(node[0], node[1], node[2]) * cell_m);
    return entry->second;
  };
  for (const Triangle& cell : cells)
    for (int axis = 0; axis < 3; ++axis)
      for (int side : {0, 1}) {
        Triangle other = cell;
        other[axis] += side == 1 ? 1 : -1;
        if (cells.contains(other)) continue;
        const auto corner = [&](int di, int dj) {
          Triangle node = cell;
          node[axis] += side;
          node[(axis + 1) % 3] += di;
          node[(axis + 2) % 3] += dj;
          return vertex(node);
        };
        int a = corner(0, 0), b = corner(1, 0), c = corner(1, 1), d = corner(0, 1);
        if (side == 0) std::swap(b, d);
        mesh.triangles.push_back({a, b, c});
        mesh.triangles.push_back({a, c, d});
      }
  return mesh;
}

}  // namespace

TriangleMesh tetrahedron() {
  return scaled(
      {{{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}}, {{0, 1, 2}, {0, 2, 3}, {0, 3, 1}, {1, 3, 2}}},
      1 / std::sqrt(8.0));
}

TriangleMesh cube() {
  return box(Vec3::Ones());
}

TriangleMesh octahedron() {
  return scaled({{{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}},
                 {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}}},
                1 / std::sqrt(2.0));
}

TriangleMesh icosahedron() {
  return scaled({{{-1, phi, 0},
                  {1, phi, 0},
                  {-1, -phi, 0},
                  {1, -phi, 0},
                  {0, -1, phi},
                  {0, 1, phi},
                  {0, -1, -phi},
                  {0, 1, -phi},
                  {phi, 0, -1},
                  {phi, 0, 1},
                  {-phi, 0, -1},
                  {-phi, 0, 1}},
                 {{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
                  {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
                  {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}}},
                0.5);
}

TriangleMesh box(const Vec3& size_m, int cells) {
  TriangleMesh mesh;
  std::map<Triangle, int> ids;
  const auto vertex = [&](const Triangle& node) {
    const auto [entry, fresh] = ids.try_emplace(node, static_cast<int>(mesh.vertices.size()));
    const Vec3 part = Vec3(node[0], node[1], node[2]) / cells;
    if (fresh) mesh.vertices.push_back((part - Vec3::Constant(0.5)).cwiseProduct(size_m));
    return entry->second;
  };
  for (int axis = 0; axis < 3; ++axis)
    for (int side : {0, cells})
      for (int i = 0; i < cells; ++i)
        for (int j = 0; j < cells; ++j) {
          const auto corner = [&](int di, int dj) {
            Triangle node;
            node[axis] = side;
            node[(axis + 1) % 3] = i + di;
            node[(axis + 2) % 3] = j + dj;
            return vertex(node);
          };
          int a = corner(0, 0), b = corner(1, 0), c = corner(1, 1), d = corner(0, 1);
          if (side == 0) std::swap(b, d);
          mesh.triangles.push_back({a, b, c});
          mesh.triangles.push_back({a, c, d});
        }
  return mesh;
}

TriangleMesh icosphere(double radius_m, int subdivisions) {
  TriangleMesh mesh = icosahedron();
  for (int i = 0; i < subdivisions; ++i) {
    mesh = quartered(mesh);
    for (Vec3& v : mesh.vertices) v.normalize();
  }
  for (Vec3& v : mesh.vertices) v *= radius_m / v.norm();
  return mesh;
}

TriangleMesh torus(double ring_radius_m, double tube_radius_m, int nu, int nv) {
  Profile tube;
  for (int i = 0; i < nv; ++i) {
    const double v = 2 * pi * i / nv;
    tube.push_back({ring_radius_m + tube_radius_m * std::cos(v), tube_radius_m * std::sin(v)});
  }
  return revolve(tube, nu, Ends::joined);
}

TriangleMesh double_torus(double ring_radius_m, double tube_radius_m, int nu, int nv) {
  TriangleMesh mesh = torus(ring_radius_m, tube_radius_m, nu, nv);
  const auto x = [&](const std::array<int, 3>& t) {
    return mesh.vertices[t[0]].x() + mesh.vertices[t[1]].x() + mesh.vertices[t[2]].x();
  };
  const auto open = std::max_element(mesh.triangles.begin(), mesh.triangles.end(),
                                     [&](const auto& a, const auto& b) { return x(a) < x(b); });
  const std::array<int, 3> mouth = *open;
  mesh.triangles.erase(open);
  const int count = static_cast<int>(mesh.vertices.size());
  const double mirror = ring_radius_m + tube_radius_m + pi * tube_radius_m / nv;
  for (int v = 0; v < count; ++v) {
    const Vec3 p = mesh.vertices[v];
    mesh.vertices.emplace_back(2 * mirror - p.x(), p.y(), p.z());
  }
  const auto half = mesh.triangles;
  for (const auto& [a, b, c] : half) mesh.triangles.push_back({a + count, c + count, b + count});
  for (int i = 0; i < 3; ++i) {
    const int a = mouth[i], b = mouth[(i + 1) % 3];
    mesh.triangles.push_back({a, b, b + count});
    mesh.triangles.push_back({a, b + count, a + count});
  }
  for (Vec3& p : mesh.vertices) p.x() -= mirror;
  return mesh;
}

TriangleMesh capped_cylinder(double radius_m, double height_m, int around) {
  const double top = height_m / 2;
  const Profile corners{{0, -top}, {radius_m, -top}, {radius_m, top}, {0, top}};
  return revolve(refined(corners, chord_m(radius_m, around)), around, Ends::apart);
}

TriangleMesh open_tube(double radius_m, double height_m, int around, int along) {
  Profile rows;
  for (int i = 0; i <= along; ++i) rows.push_back({radius_m, height_m * (double(i) / along - 0.5)});
  return revolve(rows, around, Ends::apart);
}

TriangleMesh flat_grid(double side_m, int cells) {
  TriangleMesh mesh;
  for (int j = 0; j <= cells; ++j)
    for (int i = 0; i <= cells; ++i)
      mesh.vertices.emplace_back(side_m * (double(i) / cells - 0.5), side_m * (double(j) / cells - 0.5), 0.0);
  for (int j = 0; j < cells; ++j)
    for (int i = 0; i < cells; ++i) {
      const int a = j * (cells + 1) + i, b = a + 1, d = a + cells + 1, c = d + 1;
      mesh.triangles.push_back({a, b, c});
      mesh.triangles.push_back({a, c, d});
    }
  return mesh;
}

TriangleMesh cup(double radius_m, double height_m, double wall_m, int around) {
  const double inside = radius_m - wall_m;
  const Profile corners{{0, 0},           {radius_m, 0}, {radius_m, height_m}, {inside, height_m},
                        {inside, wall_m}, {0, wall_m}};
  return revolve(refined(corners, chord_m(radius_m, around)), around, Ends::apart);
}

TriangleMesh dumbbell(double ball_radius_m, double bar_radius_m, double apart_m, int around) {
  const double spacing = chord_m(ball_radius_m, around), middle = apart_m / 2;
  const double meet = std::acos(bar_radius_m / ball_radius_m);  // angle at which bar and ball meet
  Profile profile = {{0, -middle - ball_radius_m}};
  append(profile, arc(-middle, ball_radius_m, -pi / 2, meet, spacing));
  straight_to(profile, {bar_radius_m, middle - ball_radius_m * std::sin(meet)}, spacing);
  append(profile, arc(middle, ball_radius_m, -meet, pi / 2, spacing));
  return revolve(profile, around, Ends::apart);
}

TriangleMesh knobbed_cylinder(double radius_m, double height_m, double neck_radius_m, double neck_m,
                              double knob_radius_m, int around) {
  const double spacing = chord_m(radius_m, around);
  const double meet = std::acos(neck_radius_m / knob_radius_m), top = height_m + neck_m;
  Profile profile =
      refined({{0, 0}, {radius_m, 0}, {radius_m, height_m}, {neck_radius_m, height_m}, {neck_radius_m, top}},
              spacing);
  append(profile, arc(top + knob_radius_m * std::sin(meet), knob_radius_m, -meet, pi / 2, spacing));
  return revolve(profile, around, Ends::apart);
}

TriangleMesh bowl(double radius_m, double wall_m, int around) {
  const double spacing = chord_m(radius_m, around), inside = radius_m - wall_m;
  Profile profile = {{0, -radius_m}};
  append(profile, arc(0, radius_m, -pi / 2, 0, spacing));
  straight_to(profile, {inside, 0}, spacing);
  append(profile, arc(0, inside, 0, -pi / 2, spacing));
  return revolve(profile, around, Ends::apart);
}

TriangleMesh ring_on_bar(double cell_m) {
  std::set<Triangle> cells;
  for (int y : {-1, 0}) {
    for (int x = -5; x < 5; ++x)
      for (int z = 0; z < 10; ++z)
        if (x < -3 || x >= 3 || z < 2 || z >= 8) cells.insert({x, y, z});
    for (int x : {-1, 0})
      for (int z = -16; z < 0; ++z) cells.insert({x, y, z});
  }
  return cell_surface(cells, cell_m);
}

TriangleMesh make_shape(const std::string& name, const std::vector<double>& size_m) {
  constexpr int around = 64;
  const auto refuse = [&](const std::string& sentence, const std::string& hint = "") {
    throw pipeline::UserError(pipeline::Fault::configuration, name, sentence, hint);
  };
  const std::map<std::string, std::size_t> shapes = {
      {"sphere", 1},           {"torus", 2},       {"cylinder", 2}, {"cup", 3}, {"bowl", 2}, {"dumbbell", 3},
      {"knobbed_cylinder", 5}, {"ring_on_bar", 1}, {"box", 3}};
  std::string names;
  for (const auto& [known, count] : shapes) names += (names.empty() ? "" : ", ") + known;
  const auto shape = shapes.find(name);
  if (shape == shapes.end()) refuse("shape: there is no shape '" + name + "'", "known: " + names);
  if (size_m.size() != shape->second)
    refuse(fmt::format("size_m: a {} has {} sizes, not {}", name, shape->second, size_m.size()));
  if (!std::ranges::all_of(size_m, [](double x) { return std::isfinite(x) && x > 0; }))
    refuse("size_m: every size must be above 0");
  const auto& s = size_m;
  const auto ask = [&](bool right, const char* rule) {
    if (!right) refuse(std::string("size_m: ") + rule);
  };
  if (name == "sphere") return icosphere(s[0], 4);
  if (name == "ring_on_bar") return ring_on_bar(s[0]);
  if (name == "box") return box({s[0], s[1], s[2]}, 12);
  if (name == "cylinder") return capped_cylinder(s[0], s[1], around);
  if (name == "torus") {
    ask(s[1] < s[0], "the tube must be thinner than the ring");
    return torus(s[0], s[1], 2 * around, around / 2);
  }
  if (name == "cup") {
    ask(s[2] < s[0] && s[2] < s[1], "the wall must be thinner than the cup");
    return cup(s[0], s[1], s[2], around);
  }
  if (name == "bowl") {
    ask(s[1] < s[0], "the wall must be thinner than the bowl");
    return bowl(s[0], s[1], around);
  }
  if (name == "dumbbell") {
    ask(s[1] < s[0], "the bar must be thinner than the balls");
    ask(s[2] > 2 * std::sqrt(s[0] * s[0] - s[1] * s[1]),
        "the balls must be farther apart than they meet the bar");
    return dumbbell(s[0], s[1], s[2], around);
  }
  ask(s[2] < s[0] && s[2] < s[4], "the neck must be thinner than the cylinder and the knob");
  return knobbed_cylinder(s[0], s[1], s[2], s[3], s[4], around);
}

}  // namespace geocage::datasets
