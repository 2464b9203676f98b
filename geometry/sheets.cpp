#include <algorithm>
#include <map>
#include <numeric>
#include <tuple>

#include "geometry/soup.h"

namespace geocage::geometry {

namespace {

/// One side of a triangle, seen from its smaller vertex.
struct Side {
  int low, high, triangle;
  bool forward;  ///< the triangle runs from low to high
  bool same_edge(const Side& other) const { return low == other.low && high == other.high; }
};

std::vector<Side> sorted_sides(const TriangleMesh& mesh) {
  std::vector<Side> sides;
  for (std::size_t f = 0; f < mesh.triangles.size(); ++f)
    for (int i = 0; i < 3; ++i) {
      const int a = mesh.triangles[f][i], b = mesh.triangles[f][(i + 1) % 3];
      sides.push_back({std::min(a, b), std::max(a, b), static_cast<int>(f), a < b});
    }
  std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) {
    return std::tie(a.low, a.high, a.triangle) < std::tie(b.low, b.high, b.triangle);
  });
  return sides;
}

/// Sheets of triangles that agree in which way round they go: union-find whose links say whether a triangle
/// is turned against its root.
class Sheets {
 public:
  explicit Sheets(const TriangleMesh& mesh) : parent_(mesh.triangles.size()), turned_(parent_.size(), 0) {
    std::iota(parent_.begin(), parent_.end(), 0);
    for (const auto& t : mesh.triangles) {
      const Vec3& a = mesh.vertices[t[0]];
      area_.push_back((mesh.vertices[t[1]] - a).cross(mesh.vertices[t[2]] - a).norm());
    }
  }

  /// Root of a triangle, and whether it is turned against it.
  std::pair<int, bool> root(int f) {
    bool turned = false;
    int r = f;
    for (; parent_[r] != r; r = parent_[r]) turned ^= turned_[r];
    bool left = turned;  // shorten the way
    while (parent_[f] != r && f != r) {
      const int next = parent_[f];
      const bool here = turned_[f];
      parent_[f] = r;
      turned_[f] = left;
      left ^= here;
      f = next;
    }
    return {r, turned};
  }

  double area(int f) { return area_[root(f).first]; }

  /// Joins the triangles of two sides of one edge; false when they can't agree.
  bool join(const Side& s, const Side& t) {
    const auto [a, turned_s] = root(s.triangle);
    const auto [b, turned_t] = root(t.triangle);
    const bool against = (s.forward == t.forward) != (turned_s != turned_t);
    if (a == b) return !against;
    const int keep = area_[a] >= area_[b] ? a : b, gone = keep == a ? b : a;
    parent_[gone] = keep;
    turned_[gone] = against;
    area_[keep] += area_[gone];
    return true;
  }

 private:
  std::vector<int> parent_;
  std::vector<char> turned_;
  std::vector<double> area_;
};

using Pairs = std::vector<std::pair<const Side*, const Side*>>;

/// Sides of an edge with more than two triangles: first those of one sheet that agree, the largest sheet
/// first, then any two, the largest sheets first.
void pair_crowded(std::vector<const Side*> sides, const std::map<const Side*, double>& area, Sheets& sheets,
                  Pairs& pairs) {
  std::stable_sort(sides.begin(), sides.end(),
                   [&](const Side* s, const Side* t) { return area.at(s) > area.at(t); });
  for (const bool same_sheet : {true, false})
    for (std::size_t i = 0; i < sides.size(); ++i)
      for (std::size_t j = i + 1; sides[i] && j < sides.size(); ++j) {
        if (!sides[j]) continue;
        if (same_sheet && sheets.root(sides[i]->triangle).first != sheets.root(sides[j]->triangle).first)
          continue;
        if (!sheets.join(*sides[i], *sides[j])) continue;
        pairs.emplace_back(sides[i], sides[j]);
        sides[i] = sides[j] = nullptr;
      }
}

/// Which sides stay together.
Pairs paired_sides(const std::vector<Side>& sides, Sheets& sheets) {
  Pairs pairs;
  std::vector<std::vector<const Side*>> crowded;
  for (std::size_t i = 0; i < sides.size();) {
    std::size_t end = i;
    while (end < sides.size() && sides[end].same_edge(sides[i])) ++end;
    if (end - i == 2 && sheets.join(sides[i], sides[i + 1])) pairs.emplace_back(&sides[i], &sides[i + 1]);
    if (end - i > 2) {
      auto& group = crowded.emplace_back();
      for (std::size_t k = i; k < end; ++k) group.push_back(&sides[k]);
    }
    i = end;
  }
  std::map<const Side*, double> area;  // of the sheets as they are before crowded edges join them
  for (const auto& group : crowded)
    for (const Side* side : group) area[side] = sheets.area(side->triangle);
  for (const auto& group : crowded) pair_crowded(group, area, sheets, pairs);
  return pairs;
}

/// Corners that stay one vertex: union-find over 3 * triangle + corner.
class Fans {
 public:
  explicit Fans(const TriangleMesh& mesh) : mesh_(mesh), parent_(mesh.triangles.size() * 3) {
    std::iota(parent_.begin(), parent_.end(), 0);
  }
  int root(int corner) {
    while (parent_[corner] != corner) corner = parent_[corner] = parent_[parent_[corner]];
    return corner;
  }
  void join_at(int vertex, int f, int g) { parent_[root(corner(f, vertex))] = root(corner(g, vertex)); }

 private:
  int corner(int f, int vertex) const {
    const auto& t = mesh_.triangles[f];
    return 3 * f + static_cast<int>(std::find(t.begin(), t.end(), vertex) - t.begin());
  }
  const TriangleMesh& mesh_;
  std::vector<int> parent_;
};

/// For each triangle whether to turn it: as its sheet asks, or the other way round where most would turn.
std::vector<char> turns(const TriangleMesh& mesh, Sheets& sheets) {
  std::vector<char> turn(mesh.triangles.size());
  std::vector<int> balance(turn.size(), 0);  // at the root: triangles that turn less those that don't
  for (std::size_t f = 0; f < turn.size(); ++f) {
    const auto [root, turned] = sheets.root(static_cast<int>(f));
    turn[f] = turned;
    balance[root] += turned ? 1 : -1;
  }
  for (std::size_t f = 0; f < turn.size(); ++f)
    turn[f] ^= balance[sheets.root(static_cast<int>(f)).first] > 0;
  return turn;
}

}  // namespace

TriangleMesh cut_to_manifold(const TriangleMesh& mesh, RepairCounts& counts) {
  const auto sides = sorted_sides(mesh);
  Sheets sheets(mesh);
  Fans fans(mesh);
  for (const auto& [s, t] : paired_sides(sides, sheets))
    for (int v : {s->low, s->high}) fans.join_at(v, s->triangle, t->triangle);

  TriangleMesh cut;
  cut.vertices = mesh.vertices;  // the first fan of a vertex keeps its number
  const auto turn = turns(mesh, sheets);
  std::vector<int> vertex_of(mesh.triangles.size() * 3, -1);
  std::vector<char> taken(mesh.vertices.size(), 0);
  for (std::size_t f = 0; f < mesh.triangles.size(); ++f) {
    std::array<int, 3> t;
    for (int i = 0; i < 3; ++i) {
      const int v = mesh.triangles[f][i];
      int& own = vertex_of[fans.root(static_cast<int>(3 * f) + i)];
      if (own < 0 && !taken[v]) {
        own = v;
        taken[v] = 1;
      } else if (own < 0) {
        own = static_cast<int>(cut.vertices.size());
        cut.vertices.push_back(mesh.vertices[v]);
        ++counts.split;
      }
      t[i] = own;
    }
    counts.turned += turn[f];
    if (turn[f]) std::swap(t[1], t[2]);
    cut.triangles.push_back(t);
  }
  return cut;
}

void part_touching_vertices(TriangleMesh& mesh) {
  std::map<std::array<double, 3>, std::vector<int>> at;
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    const Vec3& p = mesh.vertices[v];
    at[{p.x(), p.y(), p.z()}].push_back(static_cast<int>(v));
  }
  std::vector<std::pair<int, Vec3>> moves;
  const CompressedRows neighbours = vertex_neighbours(mesh);
  for (const auto& [position, copies] : at) {
    if (copies.size() < 2) continue;
    for (int v : copies) {
      Vec3 move = Vec3::Zero();
      for (int i = neighbours.start[v]; i < neighbours.start[v + 1]; ++i)
        move += (mesh.vertices[neighbours.items[i]] - mesh.vertices[v]) / neighbours.size(v);
      moves.emplace_back(v, 1e-3 * move);
    }
  }
  for (const auto& [v, move] : moves) mesh.vertices[v] += move;
}

}  // namespace geocage::geometry
