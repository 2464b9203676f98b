#pragma once
#include <algorithm>
#include <cmath>
#include <random>

#include "topology/polyline.h"

namespace geocage::topology {

/// Points at the angles 2 pi i / n, closed by repeating the first.
template <class Curve>
Polyline closed_polyline(int n, Curve at) {
  Polyline points;
  for (int i = 0; i <= n; ++i) points.push_back(at(2 * M_PI * (i % n) / n));
  return points;
}

inline Polyline ring(int n, const Vec3& center = Vec3::Zero()) {
  return closed_polyline(n, [&](double t) -> Vec3 { return center + Vec3(std::cos(t), std::sin(t), 0); });
}

inline Polyline reversed(Polyline points) {
  std::reverse(points.begin(), points.end());
  return points;
}

/// A point whose coordinates are even in [-1, 1].
inline Vec3 random_point(std::mt19937_64& random) {
  std::uniform_real_distribution<> even(-1, 1);
  const double x = even(random), y = even(random), z = even(random);
  return {x, y, z};
}

inline Polyline random_chain(std::mt19937_64& random, int points) {
  Polyline chain;
  for (int i = 0; i < points; ++i) chain.push_back(random_point(random));
  return chain;
}

}  // namespace geocage::topology
