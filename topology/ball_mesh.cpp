#include "topology/ball_mesh.h"

#include <algorithm>
#include <cstdint>
#include <numeric>

#include <parallel/algorithm>

#include "topology/balls.h"

namespace geocage::topology {

using geometry::TriangleMesh;
using geometry::Vec3;

namespace {

/// Place along the Hilbert curve through a cube of 2^bits cells a side (Skilling, "Programming the Hilbert
/// curve", AIP 707, 2004).
std::uint64_t hilbert_key(std::array<std::uint32_t, 3> x, int bits) {
  const std::uint32_t top = 1u << (bits - 1);
  for (std::uint32_t q = top; q > 1; q >>= 1) {
    const std::uint32_t p = q - 1;
    for (int i = 0; i < 3; ++i)
      if (x[i] & q) {
        x[0] ^= p;
      } else {
        const std::uint32_t t = (x[0] ^ x[i]) & p;
        x[0] ^= t;
        x[i] ^= t;
      }
  }
  x[1] ^= x[0];
  x[2] ^= x[1];
  std::uint32_t t = 0;
  for (std::uint32_t q = top; q > 1; q >>= 1)
    if (x[2] & q) t ^= q - 1;
  std::uint64_t key = 0;
  for (int b = bits - 1; b >= 0; --b)
    for (int i = 0; i < 3; ++i) key = 2 * key + (((x[i] ^ t) >> b) & 1);
  return key;
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
  constexpr int bits = 16;
  Vec3 low = mesh.vertices[0], high = low;
  for (const Vec3& p : mesh.vertices) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  const double scale = ((1 << bits) - 1) / std::max((high - low).maxCoeff(), 1e-300);
  std::vector<std::pair<std::uint64_t, int>> keys(mesh.vertices.size());
#pragma omp parallel for schedule(static)
  for (int v = 0; v < count; ++v) {
    std::array<std::uint32_t, 3> cell;
    for (int i = 0; i < 3; ++i) cell[i] = static_cast<std::uint32_t>(scale * (mesh.vertices[v][i] - low[i]));
    keys[v] = {hilbert_key(cell, bits), v};
  }
  __gnu_parallel::sort(keys.begin(), keys.end());  // no two are alike
  const std::vector<double> defects = angle_defects_rad(mesh);
  original.reserve(keys.size());
  points.reserve(keys.size());
  for (const auto& [key, v] : keys) {
    original.push_back(v);
    const Vec3& p = mesh.vertices[v];
    points.push_back({p.x(), p.y(), p.z(), defects[v]});
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
  std::vector<int> place(outgoing_start_.begin(), outgoing_start_.end() - 1);
  for (int h = 0; h < total; ++h) outgoing_[place[half_edges[h].from]++] = h;

  std::vector<double> lengths_m(half_edges.size());
#pragma omp parallel for schedule(static)
  for (int h = 0; h < total; ++h) {
    const int from = half_edges[h].from, to = half_edges[after(h)].from;
    int other = -1;
    for (int i = outgoing_start_[to]; i < outgoing_start_[to + 1]; ++i)
      if (half_edges[after(outgoing_[i])].from == from) other = outgoing_[i];
    half_edges[before(h)].exits[0] = other;  // h is the next side of its triangle
    half_edges[after(h)].exits[1] = other;   // and the second next of another
    lengths_m[h] = (position(from) - position(to)).norm();
  }
  measure_edges(lengths_m);
}

void BallMesh::measure_edges(const std::vector<double>& lengths_m) {
  longest_side_m.assign(static_cast<std::size_t>(count), 0);
  double sum = 0;
  int edges = 0;
  for (int f = 0; f < static_cast<int>(half_edges.size()); f += 3) {
    for (int h = f; h < f + 3; ++h) {
      const int other = half_edges[before(h)].exits[0];
      if (other >= 0 && other < h) continue;
      sum += lengths_m[h];
      ++edges;
    }
    const double longest = std::max({lengths_m[f], lengths_m[f + 1], lengths_m[f + 2]});
    for (int h = f; h < f + 3; ++h) {
      double& at = longest_side_m[half_edges[h].from];
      at = std::max(at, longest);
    }
    longest_edge_m = std::max(longest_edge_m, longest);
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
        add(half_edges[after(h)].from, h, area_m2(h));
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
