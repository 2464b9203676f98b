#include "stages/remesh/halfedges.h"

#include <algorithm>

namespace geocage::stages {

using geometry::TriangleMesh;
using geometry::Vec3;

Halfedges::Halfedges(const TriangleMesh& mesh) {
  for (const auto& t : mesh.triangles)
    for (int v : t) from_.push_back(v);
  twin_.resize(from_.size());
  std::vector<std::pair<std::pair<int, int>, int>> sides;
  sides.reserve(from_.size());
  for (int h = 0; h < halfedges(); ++h) sides.push_back({std::minmax({from(h), to(h)}), h});
  std::sort(sides.begin(), sides.end());
  for (std::size_t i = 0; i + 1 < sides.size(); i += 2) join(sides[i].second, sides[i + 1].second);

  // A vertex of the input has as many vertices here as fans: a fan not walked yet founds one.
  std::vector<int> fan(from_.size(), -1);
  for (int first = 0; first < halfedges(); ++first) {
    if (fan[first] >= 0) continue;
    const int v = static_cast<int>(position.size());
    position.push_back(mesh.vertices[from_[first]]);
    out_.push_back(first);
    valence_.push_back(0);
    for (int h = first; fan[h] < 0; h = next(twin_[h])) {
      fan[h] = v;
      ++valence_[v];
    }
  }
  from_ = std::move(fan);
  vertices_ = slots();
}

TriangleMesh Halfedges::mesh() const {
  TriangleMesh mesh;
  std::vector<int> index(position.size(), -1);
  for (int h = 0; h < halfedges(); h += 3) {
    if (!alive(h)) continue;
    std::array<int, 3> t;
    for (int i = 0; i < 3; ++i) {
      int& v = index[from_[h + i]];
      if (v < 0) {
        v = static_cast<int>(mesh.vertices.size());
        mesh.vertices.push_back(position[from_[h + i]]);
      }
      t[i] = v;
    }
    mesh.triangles.push_back(t);
  }
  return mesh;
}

Vec3 Halfedges::double_area_normal(int h) const {
  const Vec3 &a = position[from(h)], &b = position[to(h)], &c = position[opposite(h)];
  return (b - a).cross(c - a);
}

Vec3 Halfedges::double_area_normal_with(int h, int v, const Vec3& p) const {
  const Vec3& a = from(h) == v ? p : position[from(h)];
  const Vec3& b = to(h) == v ? p : position[to(h)];
  const Vec3& c = opposite(h) == v ? p : position[opposite(h)];
  return (b - a).cross(c - a);
}

bool Halfedges::connected(int a, int b) const {
  bool found = false;
  around(a, [&](int h) { found |= to(h) == b; });
  return found;
}

bool Halfedges::can_flip(int h) const {
  return valence_[from(h)] > 3 && valence_[to(h)] > 3 && !connected(opposite(h), opposite(twin_[h]));
}

/*      c                c
       / \              /|\
      a - b     ─►     a | b
       \ /              \|/
        d                d       */
void Halfedges::flip(int h) {
  const int hn = next(h), hp = prev(h), g = twin_[h], gn = next(g), gp = prev(g);
  const int a = from(h), b = to(h), c = from(hp), d = from(gp);
  const int ca = twin_[hp], ad = twin_[gn], db = twin_[gp], bc = twin_[hn];
  from_[h] = d;
  from_[hn] = c;
  from_[hp] = a;
  from_[g] = c;
  from_[gn] = d;
  from_[gp] = b;
  join(hn, ca);
  join(hp, ad);
  join(gn, db);
  join(gp, bc);
  out_[a] = hp;
  out_[b] = gp;
  out_[c] = hn;
  out_[d] = gn;
  --valence_[a];
  --valence_[b];
  ++valence_[c];
  ++valence_[d];
}

int Halfedges::split(int h, const Vec3& p) {
  const int hn = next(h), g = twin_[h], gp = prev(g);
  const int b = to(h), c = opposite(h), d = from(gp);
  const int bc = twin_[hn], db = twin_[gp];
  const int m = slots(), x = halfedges(), y = x + 3;
  position.push_back(p);
  from_.insert(from_.end(), {m, b, c, b, m, d});
  twin_.resize(from_.size());
  from_[hn] = m;
  from_[g] = m;
  join(x, y);
  join(x + 1, bc);
  join(x + 2, hn);
  join(y + 2, db);
  join(y + 1, gp);
  out_.push_back(hn);
  out_[b] = x + 1;
  valence_.push_back(4);
  ++valence_[c];
  ++valence_[d];
  ++vertices_;
  return m;
}

bool Halfedges::can_collapse(int h) const {
  const int a = from(h), b = to(h), c = opposite(h), d = opposite(twin_[h]);
  if (valence_[c] <= 3 || valence_[d] <= 3 || valence_[a] + valence_[b] <= 7) return false;
  int common = 0;
  around(a, [&](int x) { common += to(x) != b && connected(to(x), b); });
  return common == 2;
}

void Halfedges::collapse(int h) {
  const int hn = next(h), hp = prev(h), g = twin_[h], gn = next(g), gp = prev(g);
  const int a = from(h), b = to(h), c = from(hp), d = from(gp);
  const int cb = twin_[hn], ac = twin_[hp], da = twin_[gn], bd = twin_[gp];
  valence_[b] += valence_[a] - 4;
  --valence_[c];
  --valence_[d];
  around(a, [&](int x) { from_[x] = b; });
  join(cb, ac);
  join(da, bd);
  out_[b] = bd;
  out_[c] = cb;
  out_[d] = da;
  out_[a] = -1;
  for (int x : {h, hn, hp, g, gn, gp}) from_[x] = -1;
  --vertices_;
}

}  // namespace geocage::stages
