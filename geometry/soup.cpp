#include "geometry/soup.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <set>
#include <unordered_map>

namespace geocage::geometry {

namespace {

using Corners = std::array<int, 3>;

/// Triangles with finite, existing corners.
std::vector<Corners> sound_triangles(const TriangleMesh& mesh, RepairCounts& counts) {
  const int count = static_cast<int>(mesh.vertices.size());
  std::vector<Corners> sound;
  for (const Corners& t : mesh.triangles) {
    if (std::any_of(t.begin(), t.end(), [&](int v) { return v < 0 || v >= count; }))
      ++counts.bad_indices;
    else if (std::any_of(t.begin(), t.end(), [&](int v) { return !mesh.vertices[v].allFinite(); }))
      ++counts.not_finite;
    else
      sound.push_back(t);
  }
  return sound;
}

struct CellHash {
  std::size_t operator()(const std::array<std::int64_t, 3>& cell) const {
    std::uint64_t h = 0;
    for (std::int64_t c : cell) h = (h ^ static_cast<std::uint64_t>(c)) * 0x9e3779b97f4a7c15u;
    return h ^ (h >> 32);
  }
};

/// For each vertex the first one within `weld_m`.
std::vector<int> welded_to(const std::vector<Vec3>& vertices, const std::vector<char>& used, double weld_m) {
  std::unordered_map<std::array<std::int64_t, 3>, std::vector<int>, CellHash> cells;
  std::vector<int> to(vertices.size());
  std::iota(to.begin(), to.end(), 0);
  for (std::size_t v = 0; v < vertices.size(); ++v) {
    if (!used[v]) continue;
    std::array<std::int64_t, 3> cell;
    for (int k = 0; k < 3; ++k) cell[k] = std::llround(vertices[v][k] / weld_m);
    const auto near = [&](const std::array<std::int64_t, 3>& c) {
      const auto it = cells.find(c);
      if (it == cells.end()) return -1;
      for (int w : it->second)
        if ((vertices[w] - vertices[v]).squaredNorm() <= weld_m * weld_m) return w;
      return -1;
    };
    int found = -1;
    for (int n = 0; n < 27 && found < 0; ++n)
      found = near({cell[0] + n % 3 - 1, cell[1] + n / 3 % 3 - 1, cell[2] + n / 9 - 1});
    if (found >= 0)
      to[v] = found;
    else
      cells[cell].push_back(static_cast<int>(v));
  }
  return to;
}

/// The smallest height of a triangle; 0 when corners coincide.
double least_height_m(const std::vector<Vec3>& vertices, const Corners& t) {
  const Vec3 &a = vertices[t[0]], &b = vertices[t[1]], &c = vertices[t[2]];
  const double longest =
      std::sqrt(std::max({(b - a).squaredNorm(), (c - b).squaredNorm(), (a - c).squaredNorm()}));
  return longest > 0 ? (b - a).cross(c - a).norm() / longest : 0;
}

/// Sides that only one triangle has, as (from, to) -> that triangle.
std::map<std::pair<int, int>, int> border_sides(const std::vector<Corners>& triangles) {
  std::map<std::pair<int, int>, std::pair<int, int>> sides;  // low, high -> count, triangle
  for (std::size_t f = 0; f < triangles.size(); ++f)
    for (int i = 0; i < 3; ++i) {
      const int a = triangles[f][i], b = triangles[f][(i + 1) % 3];
      auto& [count, triangle] = sides[{std::min(a, b), std::max(a, b)}];
      ++count;
      triangle = static_cast<int>(f);
    }
  std::map<std::pair<int, int>, int> border;
  for (const auto& [side, seen] : sides)
    if (seen.first == 1) border[side] = seen.second;
  return border;
}

/// Border vertices in order of x, to find those on a side.
class BorderVertices {
 public:
  BorderVertices(const std::vector<Vec3>& vertices, const std::map<std::pair<int, int>, int>& border)
      : vertices_(vertices) {
    std::set<int> all;
    for (const auto& [side, triangle] : border) all.insert({side.first, side.second});
    order_.assign(all.begin(), all.end());
    std::sort(order_.begin(), order_.end(),
              [&](int v, int w) { return std::pair(vertices[v].x(), v) < std::pair(vertices[w].x(), w); });
  }

  /// Those inside the segment from a to b, in that order.
  std::vector<int> on_segment(int a, int b, double near_m) const {
    const Vec3 &p = vertices_[a], along = vertices_[b] - p;
    const double length2 = along.squaredNorm();
    const auto first =
        std::lower_bound(order_.begin(), order_.end(), std::min(p.x(), vertices_[b].x()) - near_m,
                         [&](int v, double x) { return vertices_[v].x() < x; });
    std::vector<std::pair<double, int>> found;
    for (auto it = first;
         it != order_.end() && vertices_[*it].x() <= std::max(p.x(), vertices_[b].x()) + near_m; ++it) {
      const double t = (vertices_[*it] - p).dot(along) / length2;
      if (*it == a || *it == b || t <= 0 || t >= 1) continue;
      if ((p + t * along - vertices_[*it]).norm() <= near_m) found.emplace_back(t, *it);
    }
    std::sort(found.begin(), found.end());
    std::vector<int> inside;
    inside.reserve(found.size());
    for (const auto& [t, v] : found) inside.push_back(v);
    return inside;
  }

 private:
  const std::vector<Vec3>& vertices_;
  std::vector<int> order_;
};

/// Puts border vertices into the border sides that they lie on; one side of a triangle a time.
bool split_t_junctions(const std::vector<Vec3>& vertices, std::vector<Corners>& triangles, double near_m,
                       RepairCounts& counts) {
  const auto border = border_sides(triangles);
  const BorderVertices candidates(vertices, border);
  std::set<int> touched;
  for (const auto& [side, f] : border) {
    if (touched.contains(f)) continue;
    Corners& t = triangles[f];
    int i = 0;
    while (std::minmax(t[i], t[(i + 1) % 3]) != std::pair<const int&, const int&>(side.first, side.second))
      ++i;
    const int a = t[i], b = t[(i + 1) % 3], c = t[(i + 2) % 3];
    auto inside = candidates.on_segment(a, b, near_m);
    std::erase(inside, c);
    if (inside.empty()) continue;
    touched.insert(f);
    counts.t_junctions += static_cast<int>(inside.size());
    inside.push_back(b);
    t = {a, inside[0], c};
    for (std::size_t k = 1; k < inside.size(); ++k) triangles.push_back({inside[k - 1], inside[k], c});
  }
  return !touched.empty();
}

void drop_degenerate_and_double(const std::vector<Vec3>& vertices, std::vector<Corners>& triangles,
                                double least_m, RepairCounts& counts) {
  std::set<Corners> known;
  std::erase_if(triangles, [&](const Corners& t) {
    if (least_height_m(vertices, t) < least_m) {
      ++counts.degenerate;
      return true;
    }
    Corners sorted = t;
    std::sort(sorted.begin(), sorted.end());
    if (known.insert(sorted).second) return false;
    ++counts.duplicate;
    return true;
  });
}

std::vector<char> used_vertices(std::size_t count, const std::vector<Corners>& triangles) {
  std::vector<char> used(count, 0);
  for (const Corners& t : triangles)
    for (int v : t) used[v] = 1;
  return used;
}

}  // namespace

TriangleMesh sound_part(const TriangleMesh& mesh) {
  RepairCounts ignored;
  const auto triangles = sound_triangles(mesh, ignored);
  return kept_triangles({mesh.vertices, triangles}, std::vector<char>(triangles.size(), 1));
}

TriangleMesh clean_soup(const TriangleMesh& mesh, double weld_m, RepairCounts& counts) {
  std::vector<Corners> triangles = sound_triangles(mesh, counts);
  const auto used = used_vertices(mesh.vertices.size(), triangles);
  counts.isolated += static_cast<int>(std::count(used.begin(), used.end(), 0));
  const auto to = welded_to(mesh.vertices, used, weld_m);
  for (std::size_t v = 0; v < to.size(); ++v) counts.welded += to[v] != static_cast<int>(v);
  for (Corners& t : triangles)
    for (int& v : t) v = to[v];
  drop_degenerate_and_double(mesh.vertices, triangles, weld_m, counts);
  for (int pass = 0; pass < 10 && split_t_junctions(mesh.vertices, triangles, 2 * weld_m, counts); ++pass)
    drop_degenerate_and_double(mesh.vertices, triangles, weld_m, counts);
  return kept_triangles({mesh.vertices, triangles}, std::vector<char>(triangles.size(), 1));
}

std::vector<int> parts_of(const TriangleMesh& mesh, int& count) {
  const CompressedRows around = vertex_triangles(mesh);
  std::vector<int> part(mesh.triangles.size(), -1), stack;
  count = 0;
  for (std::size_t seed = 0; seed < part.size(); ++seed) {
    if (part[seed] >= 0) continue;
    part[seed] = count;
    for (stack = {static_cast<int>(seed)}; !stack.empty();) {
      const int f = stack.back();
      stack.pop_back();
      for (int v : mesh.triangles[f])
        for (int i = around.start[v]; i < around.start[v + 1]; ++i)
          if (int& other = part[around.items[i]]; other < 0) {
            other = count;
            stack.push_back(around.items[i]);
          }
    }
    ++count;
  }
  return part;
}

TriangleMesh kept_triangles(const TriangleMesh& mesh, const std::vector<char>& keep) {
  TriangleMesh kept;
  std::vector<int> renamed(mesh.vertices.size(), -1);
  for (std::size_t f = 0; f < keep.size(); ++f)
    if (keep[f])
      for (int v : mesh.triangles[f]) renamed[v] = 0;
  for (std::size_t v = 0; v < renamed.size(); ++v)
    if (renamed[v] == 0) {
      renamed[v] = static_cast<int>(kept.vertices.size());
      kept.vertices.push_back(mesh.vertices[v]);
    }
  for (std::size_t f = 0; f < keep.size(); ++f) {
    const Corners& t = mesh.triangles[f];
    if (keep[f]) kept.triangles.push_back({renamed[t[0]], renamed[t[1]], renamed[t[2]]});
  }
  return kept;
}

int drop_parts(TriangleMesh& mesh, double smallest, bool only_largest, RepairCounts& counts) {
  int parts = 0;
  const auto part = parts_of(mesh, parts);
  if (parts == 0) return 0;
  std::vector<double> area(static_cast<std::size_t>(parts), 0);
  for (std::size_t f = 0; f < part.size(); ++f) {
    const Corners& t = mesh.triangles[f];
    const Vec3& a = mesh.vertices[t[0]];
    area[part[f]] += (mesh.vertices[t[1]] - a).cross(mesh.vertices[t[2]] - a).norm();
  }
  const auto largest = std::max_element(area.begin(), area.end());
  const double least = only_largest ? *largest : smallest * std::accumulate(area.begin(), area.end(), 0.0);
  std::vector<char> keep(part.size());
  for (std::size_t f = 0; f < part.size(); ++f)
    keep[f] = area[part[f]] >= least && (!only_largest || part[f] == largest - area.begin());
  const int kept = only_largest ? 1 : static_cast<int>(std::count_if(area.begin(), area.end(), [&](double a) {
    return a >= least;
  }));
  counts.parts += parts - kept;
  if (kept < parts) mesh = kept_triangles(mesh, keep);
  return kept;
}

}  // namespace geocage::geometry
