#include "topology/ball_mesh.h"

#include <algorithm>
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
  join_half_edges();
  link_vertices();
  std::vector<int>().swap(outgoing_);
  std::vector<int>().swap(outgoing_start_);
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
  const std::vector<double> defects = angle_defects_rad(mesh);
  original.resize(keys.size());
  points.resize(keys.size());
#pragma omp parallel for schedule(static)
  for (int i = 0; i < count; ++i) {
    const auto v = static_cast<int>(keys[i] & 0xffffffff);
    original[i] = v;
    const Vec3& p = mesh.vertices[v];
    points[i] = {p.x(), p.y(), p.z(), defects[v]};
  }
}

/// Triangles sorted by their first corner along the curve; `opposite` is known after this.
void BallMesh::order_triangles(const TriangleMesh& mesh) {
  std::vector<int> rank(mesh.vertices.size());
  for (int v = 0; v < count; ++v) rank[original[v]] = v;
  const auto first = [&](const std::array<int, 3>& t) {
    return std::min({rank[t[0]], rank[t[1]], rank[t[2]]});
  };
  std::vector<int> place(mesh.vertices.size() + 1);
  for (const auto& t : mesh.triangles) ++place[first(t) + 1];
  std::partial_sum(place.begin(), place.end(), place.begin());
  half_edges.resize(3 * mesh.triangles.size());
  for (const auto& t : mesh.triangles) {
    const int f = place[first(t)]++;
    for (int i = 0; i < 3; ++i) half_edges[3 * f + i] = {rank[t[(i + 2) % 3]], {-1, -1}, rank[t[i]]};
  }
}

void BallMesh::join_half_edges() {
  const int total = static_cast<int>(half_edges.size());
  outgoing_start_.assign(count + 1, 0);
  for (const HalfEdge& h : half_edges) ++outgoing_start_[h.from + 1];
  std::partial_sum(outgoing_start_.begin(), outgoing_start_.end(), outgoing_start_.begin());
  outgoing_.resize(half_edges.size());
  std::vector<int> heads(half_edges.size());
  std::vector<int> place(outgoing_start_.begin(), outgoing_start_.end() - 1);
  for (int h = 0; h < total; ++h) {
    const int at = place[half_edges[h].from]++;
    outgoing_[at] = h;
    heads[at] = half_edges[after(h)].from;
  }

  std::vector<double> lengths_m(half_edges.size());
#pragma omp parallel for schedule(static)
  for (int v = 0; v < count; ++v)
    for (int k = outgoing_start_[v]; k < outgoing_start_[v + 1]; ++k) {
      const int h = outgoing_[k], to = heads[k];
      const auto first = heads.begin() + outgoing_start_[to], last = heads.begin() + outgoing_start_[to + 1];
      const auto back = std::find(first, last, v);
      if (back != last && to < v) continue;  // both sides of an edge at its lower end
      lengths_m[h] = (position(v) - position(to)).norm();
      if (back == last) continue;
      const int other = outgoing_[back - heads.begin()];
      lengths_m[other] = lengths_m[h];
      for (const auto& [here, there] : {std::pair(h, other), std::pair(other, h)}) {
        half_edges[before(here)].exits[0] = there;  // `here` is the next side of its triangle
        half_edges[after(here)].exits[1] = there;   // and the second next of another
      }
    }
  measure_edges(lengths_m);
}

void BallMesh::measure_edges(const std::vector<double>& lengths_m) {
  double sum = 0;
  int edges = 0;
  for (int f = 0; f < static_cast<int>(half_edges.size()); f += 3) {
    for (int h = f; h < f + 3; ++h) {
      const int other = half_edges[before(h)].exits[0];
      if (other >= 0 && other < h) continue;
      sum += lengths_m[h];
      ++edges;
    }
    longest_edge_m = std::max({longest_edge_m, lengths_m[f], lengths_m[f + 1], lengths_m[f + 2]});
  }
  mean_edge_m = edges > 0 ? sum / edges : 0;
}

double BallMesh::area_m2(int h) const {
  const Vec3 p = position(half_edges[h].from);
  const Vec3 q = position(half_edges[after(h)].from), r = position(half_edges[h].opposite);
  return (q - p).cross(r - p).norm() / 2;
}

void BallMesh::link_vertices() {
  link_start.assign(static_cast<std::size_t>(count) + 1, 0);
#pragma omp parallel for schedule(static)
  for (int v = 0; v < count; ++v) {
    int n = outgoing_start_[v + 1] - outgoing_start_[v];
    for (int i = outgoing_start_[v]; i < outgoing_start_[v + 1]; ++i)
      if (twin(outgoing_[i]) < 0) n += 2;  // an open fan's last neighbour, and the gap
    link_start[v + 1] = n;
  }
  std::partial_sum(link_start.begin(), link_start.end(), link_start.begin());
  links.resize(static_cast<std::size_t>(link_start.back()));
  std::vector<char> done(half_edges.size());
  std::vector<double> areas_m2(half_edges.size() / 3);
#pragma omp parallel for schedule(static)
  for (std::size_t f = 0; f < areas_m2.size(); ++f) areas_m2[f] = area_m2(static_cast<int>(3 * f));
#pragma omp parallel for schedule(static)
  for (int v = 0; v < count; ++v) {
    int next = link_start[v];
    const auto add = [&](int neighbour, int half_edge, double area) {
      links.neighbour[next] = neighbour;
      links.half_edge[next] = half_edge;
      links.area_m2[next++] = area;
    };
    const auto fan = [&](int h) {  // counter-clockwise from half-edge h of v
      while (h >= 0 && !done[h]) {
        done[h] = 1;
        add(half_edges[after(h)].from, h, areas_m2[h / 3]);
        const int last = half_edges[h].opposite;
        h = half_edges[h].exits[1];  // the other side of the side that comes back to v
        if (h >= 0) continue;
        add(last, -1, 0);
        add(count, -1, 0);
      }
    };
    for (int i = outgoing_start_[v]; i < outgoing_start_[v + 1]; ++i)
      if (twin(outgoing_[i]) < 0) fan(outgoing_[i]);  // open fans begin at their border
    for (int i = outgoing_start_[v]; i < outgoing_start_[v + 1]; ++i) fan(outgoing_[i]);
  }
}

}  // namespace geocage::topology
