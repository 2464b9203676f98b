#include "topology/ball_mesh.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>

#include "topology/balls.h"

namespace geocage::topology {

using geometry::TriangleMesh;
using geometry::Vec3;

namespace {

constexpr int hilbert_bits = 10;

/// Place along the Hilbert curve through a cube of 2^hilbert_bits cells a side (Skilling, "Programming the
/// Hilbert curve", AIP 707, 2004), its cases as masks.
std::uint32_t hilbert_key(std::uint32_t x, std::uint32_t y, std::uint32_t z) {
  const auto all_if = [](std::uint32_t bit) { return -static_cast<std::uint32_t>(bit != 0); };
  for (std::uint32_t q = 1u << (hilbert_bits - 1); q > 1; q >>= 1) {
    const std::uint32_t p = q - 1;
    x ^= p & all_if(x & q);
    for (std::uint32_t* other : {&y, &z}) {
      const std::uint32_t set = all_if(*other & q), t = (x ^ *other) & p & ~set;
      x ^= (p & set) | t;
      *other ^= t;
    }
  }
  y ^= x;
  z ^= y;
  std::uint32_t t = 0;
  for (std::uint32_t q = 1u << (hilbert_bits - 1); q > 1; q >>= 1) t ^= (q - 1) & all_if(z & q);
  const auto spread = [](std::uint32_t bits) {  // two zeros after each bit
    bits = (bits | bits << 16) & 0x030000ff;
    bits = (bits | bits << 8) & 0x0300f00f;
    bits = (bits | bits << 4) & 0x030c30c3;
    return (bits | bits << 2) & 0x09249249;
  };
  return spread(x ^ t) << 2 | spread(y ^ t) << 1 | spread(z ^ t);
}

/// By their upper 32 bits, of which the lowest 3 hilbert_bits count; what is alike keeps its order.
void sort_by_key(std::vector<std::uint64_t>& items) {
  std::vector<std::uint64_t> sorted(items.size());
  for (int pass = 0; pass < 3; ++pass) {
    const int shift = 32 + hilbert_bits * pass;
    const auto digit = [&](std::uint64_t item) { return (item >> shift) & ((1 << hilbert_bits) - 1); };
    std::array<std::uint32_t, (1 << hilbert_bits) + 1> place{};
    for (std::uint64_t item : items) ++place[digit(item) + 1];
    std::partial_sum(place.begin(), place.end(), place.begin());
    for (std::uint64_t item : items) sorted[place[digit(item)]++] = item;
    items.swap(sorted);
  }
}

}  // namespace

BallMesh::BallMesh(const TriangleMesh& mesh) : count(static_cast<int>(mesh.vertices.size())) {
  order_vertices(mesh);
  order_triangles(mesh);
  Draft draft;
  list_outgoing(draft);
  measure_triangles(draft);
  join_rings(draft);
  link_vertices(draft);
  measure_vertices(draft);
  if (!draft.thin) return;
  const std::vector<double> defects = angle_defects_rad(mesh);
  for (int v = 0; v < count; ++v) points[v].defect_rad = defects[original[v]];
}

void BallMesh::order_vertices(const TriangleMesh& mesh) {
  Vec3 low = mesh.vertices[0], high = low;
  for (const Vec3& p : mesh.vertices) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  const double scale = ((1 << hilbert_bits) - 1) / std::max((high - low).maxCoeff(), 1e-300);
  std::vector<std::uint64_t> keys(mesh.vertices.size());
#pragma omp parallel for schedule(static)
  for (int v = 0; v < count; ++v) {
    const auto cell = [&](int i) {
      return static_cast<std::uint32_t>(scale * (mesh.vertices[v][i] - low[i]));
    };
    keys[v] = static_cast<std::uint64_t>(hilbert_key(cell(0), cell(1), cell(2))) << 32 |
              static_cast<std::uint32_t>(v);
  }
  sort_by_key(keys);
  original.resize(keys.size());
  points.resize(keys.size());
#pragma omp parallel for schedule(static)
  for (int i = 0; i < count; ++i) {
    const auto v = static_cast<int>(keys[i] & 0xffffffff);
    original[i] = v;
    const Vec3& p = mesh.vertices[v];
    points[i] = {p.x(), p.y(), p.z(), 0};
  }
}

/// Triangles sorted by their first corner along the curve; `opposite` is known after this.
void BallMesh::order_triangles(const TriangleMesh& mesh) {
  const auto total = static_cast<int>(mesh.triangles.size());
  std::vector<int> rank(mesh.vertices.size()), first(mesh.triangles.size()), sorted(mesh.triangles.size());
  std::vector<int> place(mesh.vertices.size() + 1);
#pragma omp parallel
  {
#pragma omp for schedule(static)
    for (int v = 0; v < count; ++v) rank[original[v]] = v;
#pragma omp for schedule(static)
    for (int f = 0; f < total; ++f) {
      const auto& t = mesh.triangles[f];
      first[f] = std::min({rank[t[0]], rank[t[1]], rank[t[2]]});
    }
  }
  for (int v : first) ++place[v + 1];
  std::partial_sum(place.begin(), place.end(), place.begin());
  for (int f = 0; f < total; ++f) sorted[place[first[f]]++] = f;
  half_edges.resize(3 * mesh.triangles.size());
#pragma omp parallel for schedule(static)
  for (int f = 0; f < total; ++f) {
    const auto& t = mesh.triangles[sorted[f]];
    for (int i = 0; i < 3; ++i) half_edges[3 * f + i] = {rank[t[(i + 2) % 3]], {-1, -1}, rank[t[i]]};
  }
}

void BallMesh::list_outgoing(Draft& draft) const {
  draft.start.assign(static_cast<std::size_t>(count) + 1, 0);
  for (const HalfEdge& h : half_edges) ++draft.start[h.from + 1];
  std::partial_sum(draft.start.begin(), draft.start.end(), draft.start.begin());
  draft.outgoing.resize(half_edges.size());
  std::vector<int> place(draft.start.begin(), draft.start.end() - 1);
  for (int h = 0; h < static_cast<int>(half_edges.size()); ++h)
    draft.outgoing[place[half_edges[h].from]++] = h;
}

void BallMesh::measure_triangles(Draft& draft) const {
  constexpr double thin = 1e-3;  // twice the area over the longest side's square
  const auto total = static_cast<int>(half_edges.size() / 3);
  draft.twice_area_m2.resize(half_edges.size() / 3);
  draft.longest_m2.resize(half_edges.size() / 3);
  bool any_thin = false;
#pragma omp parallel for schedule(static) reduction(|| : any_thin)
  for (int f = 0; f < total; ++f) {
    const HalfEdge* sides = half_edges.data() + 3 * static_cast<std::ptrdiff_t>(f);
    const Vec3 p = position(sides[0].from), q = position(sides[1].from), r = position(sides[2].from);
    const double twice = (q - p).cross(r - p).norm();
    const double most2 = std::max({(q - p).squaredNorm(), (r - q).squaredNorm(), (p - r).squaredNorm()});
    draft.twice_area_m2[f] = twice;
    draft.longest_m2[f] = most2;
    any_thin = any_thin || !(twice > thin * most2);
  }
  draft.thin = any_thin;
}

/// What leaves each vertex, counter-clockwise; open fans first, each from its border on. The triangle of the
/// half-edge h = v -> a is v a b: what follows it begins v -> b, and the other side of h is in the one that
/// ends with a.
void BallMesh::join_rings(Draft& draft) {
  struct Spoke {
    int half_edge, to, last, before, next;
  };
  std::vector<int> gaps(static_cast<std::size_t>(count) + 1);
#pragma omp parallel
  {
    std::vector<Spoke> spokes;
#pragma omp for schedule(static)
    for (int v = 0; v < count; ++v) {
      int* const out = draft.outgoing.data() + draft.start[v];
      const int size = draft.start[v + 1] - draft.start[v];
      spokes.clear();
      for (int k = 0; k < size; ++k)
        spokes.push_back({out[k], half_edges[after(out[k])].from, half_edges[out[k]].opposite, -1, -1});
      for (int k = 0; k < size; ++k) {
        Spoke& spoke = spokes[k];
        for (int j = 0; j < size && spoke.before < 0; ++j)
          if (spokes[j].last == spoke.to) spoke.before = j;
        if (spoke.before >= 0) spokes[spoke.before].next = k;
        const int twin = spoke.before < 0 ? -1 : before(spokes[spoke.before].half_edge);
        half_edges[before(spoke.half_edge)].exits[0] = twin;  // the half-edge is the next side of this one
        half_edges[after(spoke.half_edge)].exits[1] = twin;   // and the second next of another
        gaps[v + 1] += twin < 0;
      }
      int next = 0;
      const auto fan = [&](int from) {
        for (int k = from; k >= 0 && spokes[k].half_edge >= 0; k = spokes[k].next) {
          out[next++] = spokes[k].half_edge;
          spokes[k].half_edge = -1;
        }
      };
      for (int k = 0; k < size; ++k)
        if (spokes[k].before < 0) fan(k);
      for (int k = 0; k < size; ++k) fan(k);
    }
  }
  link_start = draft.start;
  std::partial_sum(gaps.begin(), gaps.end(), gaps.begin());
  for (int v = 0; v <= count; ++v) link_start[v] += 2 * gaps[v];
}

void BallMesh::link_vertices(const Draft& draft) {
  links.resize(static_cast<std::size_t>(link_start.back()));
#pragma omp parallel for schedule(static)
  for (int v = 0; v < count; ++v) {
    int next = link_start[v];
    const auto add = [&](int neighbour, int half_edge, double area) {
      links.neighbour[next] = neighbour;
      links.half_edge[next] = half_edge;
      links.area_m2[next++] = area;
    };
    for (int k = draft.start[v]; k < draft.start[v + 1]; ++k) {
      const int h = draft.outgoing[k];
      add(half_edges[after(h)].from, h, draft.twice_area_m2[h / 3] / 2);
      if (half_edges[h].exits[1] >= 0) continue;  // the other side of the side that comes back to v
      add(half_edges[h].opposite, -1, 0);         // an open fan's last neighbour, and the gap
      add(count, -1, 0);
    }
  }
}

/// Edges, each from its lower end, and angle defects. The angles round a vertex add up as the arguments of
/// complex numbers do that are multiplied: one arc tangent a vertex, and full turns counted where the product
/// comes up to the half-plane above the real axis (an angle is at most pi).
void BallMesh::measure_vertices(const Draft& draft) {
  constexpr int block = 1024;  // sums are the same for any number of threads
  const int blocks = (count + block - 1) / block;
  std::vector<double> sums(static_cast<std::size_t>(blocks)), longest(sums);
  std::vector<int> edges(static_cast<std::size_t>(blocks));
  longest_m.resize(static_cast<std::size_t>(count));
#pragma omp parallel for schedule(static)
  for (int b = 0; b < blocks; ++b)
    for (int v = b * block; v < std::min(count, (b + 1) * block); ++v) {
      const Vec3 p = position(v);
      double x = 1, y = 0, turns = 0, most2 = 0;
      for (int i = link_start[v]; i < link_start[v + 1]; ++i) {
        const int h = links.half_edge[i];
        if (h < 0) continue;
        const Vec3 to = position(links.neighbour[i]) - p, next = position(half_edges[h].opposite) - p;
        const double dot = to.dot(next), twice = draft.twice_area_m2[h / 3];
        const double scale = 1 / (std::abs(dot) + twice), c = dot * scale, s = twice * scale;
        const bool below = y < 0;
        const double new_x = x * c - y * s;
        y = x * s + y * c;
        x = new_x;
        if (std::abs(x) + std::abs(y) < 1e-200) {  // each factor is between 0.7 and 1 long
          x *= 1e200;
          y *= 1e200;
        }
        turns += below && y >= 0;
        most2 = std::max(most2, draft.longest_m2[h / 3]);
        if (twin(h) >= 0 && links.neighbour[i] < v) continue;
        const double length = to.norm();
        sums[b] += length;
        longest[b] = std::max(longest[b], length);
        ++edges[b];
      }
      longest_m[v] = static_cast<float>(std::sqrt(most2));
      const double angle = std::atan2(y + 0.0, x);
      points[v].defect_rad = 2 * M_PI - (turns + (y < 0)) * 2 * M_PI - angle;
    }
  const double sum = std::accumulate(sums.begin(), sums.end(), 0.0);
  const int total = std::accumulate(edges.begin(), edges.end(), 0);
  mean_edge_m = total > 0 ? sum / total : 0;
  if (blocks > 0) longest_edge_m = *std::max_element(longest.begin(), longest.end());
}

}  // namespace geocage::topology
