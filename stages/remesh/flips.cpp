#include <algorithm>

#include "stages/remesh/remesher.h"

namespace geocage::stages {

using geometry::Vec3;

/// The edge is no fold, and the two new triangles neither fold nor turn away from the old ones.
bool Remesher::flip_keeps_shape(int h) const {
  if (folded(h)) return false;
  const int g = mesh_.twin(h);
  const Vec3 &a = mesh_.position[mesh_.from(h)], &b = mesh_.position[mesh_.to(h)],
             &c = mesh_.position[mesh_.opposite(h)], &d = mesh_.position[mesh_.opposite(g)];
  const Vec3 n1 = mesh_.double_area_normal(h), n2 = mesh_.double_area_normal(g);
  const Vec3 m1 = (d - a).cross(c - a), m2 = (c - b).cross(d - b);
  const double after = cos_between(m1, m2);
  return after > 0 && after > std::min(0.7, cos_between(n1, n2)) && cos_between(m1, n1 + n2) > 0.5 &&
         cos_between(m2, n1 + n2) > 0.5;
}

/// Flips that bring the four valences nearer to 6, by the sum of squares.
void Remesher::flip_for_valence() {
  for (int pass = 0; pass < 4; ++pass) {
    int done = 0;
    for (int h = 0; h < mesh_.halfedges(); ++h) {
      if (!mesh_.alive(h) || h > mesh_.twin(h)) continue;
      const int a = mesh_.from(h), b = mesh_.to(h), c = mesh_.opposite(h), d = mesh_.opposite(mesh_.twin(h));
      // (x - 6)^2 - (x - 6 -+ 1)^2, summed over the four
      const int gain = 2 * (mesh_.valence(a) + mesh_.valence(b) - mesh_.valence(c) - mesh_.valence(d)) - 4;
      if (gain <= 0 || !mesh_.can_flip(h) || !flip_keeps_shape(h)) continue;
      if ((mesh_.position[c] - mesh_.position[d]).squaredNorm() > 4 * mesh_.length2(h)) continue;
      mesh_.flip(h);
      ++done;
    }
    if (done == 0) return;
  }
}

/// Flips that make a small angle clearly larger.
void Remesher::flip_for_angle() {
  constexpr double small_rad = 0.66, clearly_rad = 0.02;
  for (int h = 0; h < mesh_.halfedges(); ++h) {
    if (!mesh_.alive(h) || h > mesh_.twin(h)) continue;
    const int g = mesh_.twin(h);
    const double before = std::min(least_angle(h), least_angle(g));
    if (before > small_rad) continue;
    const Vec3 &a = mesh_.position[mesh_.from(h)], &b = mesh_.position[mesh_.to(h)],
               &c = mesh_.position[mesh_.opposite(h)], &d = mesh_.position[mesh_.opposite(g)];
    const double after = std::min(stages::least_angle(a, d, c), stages::least_angle(b, c, d));
    if (after > before + clearly_rad && mesh_.can_flip(h) && flip_keeps_shape(h)) mesh_.flip(h);
  }
}

}  // namespace geocage::stages
