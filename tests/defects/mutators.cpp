#include "tests/defects/mutators.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <set>

namespace geocage::tests {

using geometry::TriangleMesh;
using geometry::Vec3;

namespace {

class Dice {
 public:
  explicit Dice(std::uint64_t seed) : random_(seed * 0x9e3779b97f4a7c15u + 1) {}
  int below(std::size_t n) { return static_cast<int>(random_() % n); }
  double unit() { return static_cast<double>(random_() >> 11) * 0x1p-53; }
  Vec3 in_cube() {
    const double x = unit(), y = unit(), z = unit();
    return 2 * Vec3(x, y, z) - Vec3::Ones();
  }

 private:
  std::mt19937_64 random_;
};

double diagonal(const TriangleMesh& mesh) {
  return check_mesh(mesh).diagonal_m();
}
Vec3 middle(const TriangleMesh& mesh) {
  const auto report = check_mesh(mesh);
  return (report.box_min + report.box_max) / 2;
}
int add(TriangleMesh& mesh, const Vec3& p) {
  mesh.vertices.push_back(p);
  return static_cast<int>(mesh.vertices.size()) - 1;
}
void append(TriangleMesh& mesh, const TriangleMesh& other, const Vec3& shift) {
  const int first = static_cast<int>(mesh.vertices.size());
  for (const Vec3& p : other.vertices) mesh.vertices.push_back(p + shift);
  for (auto t : other.triangles) mesh.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
}
void add_tetrahedron(TriangleMesh& mesh, int apex, const Vec3& direction, double size) {
  const Vec3 tip = mesh.vertices[apex], base = tip + size * direction;
  const Eigen::Matrix3d frame = geometry::frame_from_z(direction);
  std::array<int, 3> b;
  for (int i = 0; i < 3; ++i) {
    const double angle = 2 * M_PI * i / 3;
    b[i] = add(mesh, base + size / 2 * (std::cos(angle) * frame.col(0) + std::sin(angle) * frame.col(1)));
  }
  mesh.triangles.push_back({b[0], b[1], b[2]});
  for (int i = 0; i < 3; ++i) mesh.triangles.push_back({apex, b[(i + 1) % 3], b[i]});
}
/// Every triangle gets corners of its own, moved by `jitter`.
void unweld(TriangleMesh& mesh, double jitter, Dice& dice) {
  TriangleMesh loose;
  for (auto t : mesh.triangles) {
    for (int& v : t) v = add(loose, mesh.vertices[v] + jitter * dice.in_cube());
    loose.triangles.push_back(t);
  }
  mesh = loose;
}

void small_holes(TriangleMesh& mesh, std::uint64_t seed) {
  Dice dice(seed);
  for (int i = 0; i < 5; ++i)
    mesh.triangles.erase(mesh.triangles.begin() + dice.below(mesh.triangles.size()));
}
void large_hole(TriangleMesh& mesh, std::uint64_t seed) {
  Dice dice(seed);
  const Vec3 at = mesh.vertices[dice.below(mesh.vertices.size())];
  const double radius = 0.1 * diagonal(mesh);
  std::erase_if(mesh.triangles, [&](const auto& t) { return (mesh.vertices[t[0]] - at).norm() < radius; });
}
void cut_in_half(TriangleMesh& mesh, std::uint64_t seed) {
  Dice dice(seed);
  const Vec3 normal = dice.in_cube().normalized(), at = middle(mesh);
  std::erase_if(mesh.triangles, [&](const auto& t) { return (mesh.vertices[t[0]] - at).dot(normal) > 0; });
}
void flipped_faces(TriangleMesh& mesh, std::uint64_t seed) {
  Dice dice(seed);
  for (auto& t : mesh.triangles)
    if (dice.unit() < 0.1) std::swap(t[0], t[1]);
}
void inverted(TriangleMesh& mesh, std::uint64_t) {
  for (auto& t : mesh.triangles) std::swap(t[0], t[1]);
}
void double_faces(TriangleMesh& mesh, std::uint64_t seed) {
  Dice dice(seed);
  for (int i = 0; i < 20; ++i) mesh.triangles.push_back(mesh.triangles[dice.below(mesh.triangles.size())]);
}
void two_sided(TriangleMesh& mesh, std::uint64_t) {
  const auto front = mesh.triangles;
  for (const auto& t : front) mesh.triangles.push_back({t[1], t[0], t[2]});
}
void double_vertices(TriangleMesh& mesh, std::uint64_t seed) {
  Dice dice(seed);
  unweld(mesh, 0, dice);
}
void near_double_vertices(TriangleMesh& mesh, std::uint64_t seed) {
  Dice dice(seed);
  unweld(mesh, 1e-8 * diagonal(mesh), dice);
}
void cracks(TriangleMesh& mesh, std::uint64_t seed) {
  Dice dice(seed);
  const double crack = 1e-4 * diagonal(mesh);
  for (int i = 0; i < 30; ++i) {
    const int f = dice.below(mesh.triangles.size()), corner = dice.below(3);
    mesh.triangles[f][corner] = add(mesh, mesh.vertices[mesh.triangles[f][corner]] + crack * dice.in_cube());
  }
}
void t_junctions(TriangleMesh& mesh, std::uint64_t seed) {
  Dice dice(seed);
  for (int i = 0; i < 20; ++i) {
    auto& t = mesh.triangles[dice.below(mesh.triangles.size())];
    const auto [a, b, c] = t;
    const int m = add(mesh, (mesh.vertices[a] + mesh.vertices[b]) / 2);
    t = {a, m, c};
    mesh.triangles.push_back({m, b, c});
  }
}
void fins(TriangleMesh& mesh, std::uint64_t seed) {
  Dice dice(seed);
  const double size = 0.05 * diagonal(mesh);
  for (int i = 0; i < 10; ++i) {
    const auto t = mesh.triangles[dice.below(mesh.triangles.size())];
    mesh.triangles.push_back({t[0], t[1], add(mesh, mesh.vertices[t[0]] + size * dice.in_cube())});
  }
}
void pinched_by_a_part(TriangleMesh& mesh, std::uint64_t seed) {
  Dice dice(seed);
  const auto normals = vertex_normals(mesh);
  for (int i = 0; i < 3; ++i) {
    const int v = dice.below(normals.size());
    if (normals[v].allFinite()) add_tetrahedron(mesh, v, normals[v], 0.1 * diagonal(mesh));
  }
}
void pinched_in_itself(TriangleMesh& mesh, std::uint64_t seed) {
  Dice dice(seed);
  const int v = dice.below(mesh.vertices.size()), w = dice.below(mesh.vertices.size());
  for (auto& t : mesh.triangles)
    for (int& corner : t)
      if (corner == w) corner = v;
}
void touching_at_an_edge(TriangleMesh& mesh, std::uint64_t seed) {
  Dice dice(seed);
  const auto t = mesh.triangles[dice.below(mesh.triangles.size())];
  const Vec3 normal = vertex_normals(mesh)[t[0]];
  const Vec3 a = mesh.vertices[t[0]], side = mesh.vertices[t[1]] - a;
  const Vec3 across = normal.cross(side);
  const int p = add(mesh, a + side.norm() * normal + 0.2 * across),
            q = add(mesh, a + side.norm() * normal - 0.2 * across);
  mesh.triangles.push_back({t[0], t[1], p});
  mesh.triangles.push_back({t[1], t[0], q});
  mesh.triangles.push_back({t[0], p, q});
  mesh.triangles.push_back({t[1], q, p});
}
void spikes(TriangleMesh& mesh, std::uint64_t seed) {
  Dice dice(seed);
  const auto normals = vertex_normals(mesh);
  for (int i = 0; i < 2; ++i) {
    const int v = dice.below(normals.size());
    mesh.vertices[v] -= (0.3 + dice.unit()) * diagonal(mesh) * normals[v];
  }
}
void interpenetrating_copy(TriangleMesh& mesh, std::uint64_t seed) {
  Dice dice(seed);
  append(mesh, TriangleMesh(mesh), 0.2 * diagonal(mesh) * dice.in_cube().normalized());
}
void copy_far_away(TriangleMesh& mesh, std::uint64_t seed) {
  Dice dice(seed);
  append(mesh, TriangleMesh(mesh), 3 * diagonal(mesh) * dice.in_cube().normalized());
}
void tiny_parts(TriangleMesh& mesh, std::uint64_t seed) {
  Dice dice(seed);
  const Vec3 at = middle(mesh);
  const double size = diagonal(mesh);
  for (int i = 0; i < 5; ++i)
    add_tetrahedron(mesh, add(mesh, at + size * dice.in_cube()), dice.in_cube().normalized(), 0.01 * size);
}
void slivers(TriangleMesh& mesh, std::uint64_t seed) {
  Dice dice(seed);
  for (int i = 0; i < 20; ++i) {
    auto& t = mesh.triangles[dice.below(mesh.triangles.size())];
    const auto [a, b, c] = t;
    const Vec3 on_side = mesh.vertices[a] + (0.2 + 0.6 * dice.unit()) * (mesh.vertices[b] - mesh.vertices[a]);
    const int m = add(mesh, on_side + 1e-9 * (mesh.vertices[c] - on_side));
    t = {a, b, m};
    mesh.triangles.push_back({b, c, m});
    mesh.triangles.push_back({c, a, m});
  }
}
void not_a_number(TriangleMesh& mesh, std::uint64_t seed) {
  Dice dice(seed);
  for (int i = 0; i < 3; ++i)
    mesh.vertices[dice.below(mesh.vertices.size())][i] = std::numeric_limits<double>::quiet_NaN();
}
void infinite(TriangleMesh& mesh, std::uint64_t seed) {
  Dice dice(seed);
  mesh.vertices[dice.below(mesh.vertices.size())].x() = -std::numeric_limits<double>::infinity();
}
void huge(TriangleMesh& mesh, std::uint64_t seed) {
  Dice dice(seed);
  mesh.vertices[dice.below(mesh.vertices.size())].y() = std::pow(10.0, 3 + 60 * dice.unit());
}
void no_area(TriangleMesh& mesh, std::uint64_t seed) {
  Dice dice(seed);
  for (int i = 0; i < 10; ++i) {
    const int v = dice.below(mesh.vertices.size()), w = dice.below(mesh.vertices.size());
    mesh.triangles.push_back({v, v, w});
    mesh.triangles.push_back({v, w, add(mesh, (mesh.vertices[v] + mesh.vertices[w]) / 2)});
  }
}
void flattened(TriangleMesh& mesh, std::uint64_t seed) {
  Dice dice(seed);
  const int axis = dice.below(3);
  for (Vec3& p : mesh.vertices) p[axis] = 0;
}
void inner_walls(TriangleMesh& mesh, std::uint64_t seed) {
  Dice dice(seed);
  for (int i = 0; i < 3; ++i) {
    const auto t = mesh.triangles[dice.below(mesh.triangles.size())];
    mesh.triangles.push_back({t[0], t[1], dice.below(mesh.vertices.size())});
  }
}
void unused_vertices(TriangleMesh& mesh, std::uint64_t seed) {
  Dice dice(seed);
  const double size = diagonal(mesh);
  for (int i = 0; i < 10; ++i) add(mesh, size * dice.in_cube());
}
void bad_indices(TriangleMesh& mesh, std::uint64_t seed) {
  Dice dice(seed);
  mesh.triangles[dice.below(mesh.triangles.size())][0] = -1;
  mesh.triangles[dice.below(mesh.triangles.size())][1] = std::numeric_limits<int>::max();
  mesh.triangles[dice.below(mesh.triangles.size())][2] = static_cast<int>(mesh.vertices.size());
}
void folded(TriangleMesh& mesh, std::uint64_t seed) {
  Dice dice(seed);
  for (int i = 0; i < 10; ++i) {
    const auto t = mesh.triangles[dice.below(mesh.triangles.size())];
    const Vec3 side = (mesh.vertices[t[1]] + mesh.vertices[t[2]]) / 2;
    mesh.vertices[t[0]] += 1.5 * (side - mesh.vertices[t[0]]);
  }
}
void noise(TriangleMesh& mesh, std::uint64_t seed) {
  Dice dice(seed);
  const double size = 0.6 * geometry::mean_edge_m(mesh);
  for (Vec3& p : mesh.vertices) p += size * dice.in_cube();
}
void millimetres(TriangleMesh& mesh, std::uint64_t) {
  for (Vec3& p : mesh.vertices) p *= 1000;
}
void only_triangles_of_chance(TriangleMesh& mesh, std::uint64_t seed) {
  Dice dice(seed);
  for (auto& t : mesh.triangles)
    if (dice.unit() < 0.02)
      for (int& v : t) v = dice.below(mesh.vertices.size());
}
void nothing_left(TriangleMesh& mesh, std::uint64_t) {
  mesh.triangles.clear();
}
void moebius(TriangleMesh& mesh, std::uint64_t seed) {
  const double size = diagonal(mesh) / 4;
  constexpr int n = 40;
  const Vec3 at = middle(mesh);
  mesh = {};
  for (int i = 0; i < n; ++i) {
    const double u = 2 * M_PI * (i + static_cast<double>(seed)) / n;
    for (double v : {-0.4, 0.4})
      add(mesh, at + size * Vec3((1 + v * std::cos(u / 2)) * std::cos(u),
                                 (1 + v * std::cos(u / 2)) * std::sin(u), v * std::sin(u / 2)));
  }
  for (int i = 0; i < n; ++i) {
    const bool last = i + 1 == n;
    const int a = 2 * i, b = 2 * i + 1, c = last ? 1 : a + 2, d = last ? 0 : b + 2;
    mesh.triangles.push_back({a, c, b});
    mesh.triangles.push_back({b, c, d});
  }
}

}  // namespace

const std::vector<Mutator>& mutators() {
  static const std::vector<Mutator> all = {
      {"small holes", small_holes},
      {"large hole", large_hole},
      {"cut in half", cut_in_half},
      {"flipped faces", flipped_faces},
      {"inverted", inverted},
      {"double faces", double_faces},
      {"two-sided", two_sided},
      {"double vertices", double_vertices},
      {"near-double vertices", near_double_vertices},
      {"cracks", cracks},
      {"T-junctions", t_junctions},
      {"fins", fins},
      {"pinched by a part", pinched_by_a_part},
      {"pinched in itself", pinched_in_itself},
      {"touching at an edge", touching_at_an_edge},
      {"spikes", spikes},
      {"interpenetrating copy", interpenetrating_copy},
      {"copy far away", copy_far_away},
      {"tiny parts", tiny_parts},
      {"slivers", slivers},
      {"NaN", not_a_number},
      {"infinite", infinite},
      {"huge", huge},
      {"no area", no_area},
      {"flattened", flattened},
      {"inner walls", inner_walls},
      {"unused vertices", unused_vertices},
      {"bad indices", bad_indices},
      {"folded", folded},
      {"noise", noise},
      {"millimetres", millimetres},
      {"triangles of chance", only_triangles_of_chance},
      {"nothing left", nothing_left},
      {"Moebius strip", moebius},
  };
  return all;
}

}  // namespace geocage::tests
