#include <algorithm>

#include "stages/remesh/remesher.h"

namespace geocage::stages {

using geometry::Vec3;

namespace {
constexpr int passes = 12;
constexpr int most_valence = 8;
}  // namespace

/// Live edges of some lengths as (length^2, halfedge), ascending.
std::vector<std::pair<double, int>> Remesher::edges(double least_m, double most_m) const {
  std::vector<std::pair<double, int>> list;
  for (int h = 0; h < mesh_.halfedges(); ++h) {
    if (!mesh_.alive(h) || h > mesh_.twin(h)) continue;
    const double length2 = mesh_.length2(h);
    if (length2 >= least_m * least_m && length2 <= most_m * most_m) list.emplace_back(length2, h);
  }
  std::sort(list.begin(), list.end());
  return list;
}

void Remesher::split(int h) {
  near_.push_back(near_[mesh_.from(h)]);
  mesh_.split(h, (mesh_.position[mesh_.from(h)] + mesh_.position[mesh_.to(h)]) / 2);
}

void Remesher::split_longer(double longest_m) {
  for (int pass = 0; pass < passes; ++pass) {
    const auto list = edges(longest_m, std::numeric_limits<double>::infinity());
    if (list.empty()) return;
    for (auto it = list.rbegin(); it != list.rend(); ++it)
      if (mesh_.length2(it->second) >= it->first) split(it->second);
  }
}

/// Shrinks the edge of h to its far end, or to its middle where both ends are alike, unless that leaves edges
/// longer than `longest_m`, turns a triangle, or moves a fold.
bool Remesher::collapse(int h, double longest_m) {
  if (!mesh_.can_collapse(h)) return false;
  const int a = mesh_.from(h), b = mesh_.to(h);
  if (mesh_.valence(a) + mesh_.valence(b) - 4 > most_valence) return false;
  const int folds_a = folds(a).count, folds_b = folds(b).count;
  if (folds_a > folds_b || (folds_a == folds_b && folds_a > 2)) return false;
  if (folds_a >= 2 && !folded(h)) return false;
  const Vec3 target =
      folds_b > folds_a ? mesh_.position[b] : Vec3((mesh_.position[a] + mesh_.position[b]) / 2);
  bool good = true;
  for (int v : {a, b})
    mesh_.around(v, [&](int x) {
      const int to = mesh_.to(x), opposite = mesh_.opposite(x);
      if (to == a || to == b) return;
      good &= (mesh_.position[to] - target).squaredNorm() <= longest_m * longest_m;
      if (opposite == a || opposite == b) return;
      const Vec3 before = mesh_.double_area_normal(x), after = mesh_.double_area_normal_with(x, v, target);
      good &= after.norm() >= flat_m2_ && (before.norm() <= flat_m2_ || cos_between(before, after) >= 0.5);
    });
  if (!good) return false;
  mesh_.collapse(h);
  mesh_.position[b] = target;
  return true;
}

bool Remesher::collapse_either(int h, double longest_m) {
  return collapse(h, longest_m) || collapse(mesh_.twin(h), longest_m);
}

void Remesher::collapse_shorter(double shortest_m) {
  for (int pass = 0; pass < passes; ++pass) {
    const auto list = edges(0, shortest_m);
    std::size_t done = 0;
    for (const auto& [length2, h] : list)
      if (mesh_.alive(h) && mesh_.length2(h) <= shortest_m * shortest_m)
        done += collapse_either(h, 4.0 / 3 * edge_m_);
    if (done <= list.size() / 50) return;  // the rest can't go: later rounds find them in another shape
  }
}

void Remesher::meet_count(int wanted) {
  const auto list = edges(0, std::numeric_limits<double>::infinity());
  // Edges next to a move have another length by then; they wait for the next call.
  if (mesh_.vertices() > wanted) {
    for (auto it = list.begin(); it != list.end() && mesh_.vertices() > wanted; ++it)
      if (mesh_.alive(it->second) && mesh_.length2(it->second) == it->first)
        collapse_either(it->second, 1.6 * edge_m_);
  } else {
    for (auto it = list.rbegin(); it != list.rend() && mesh_.vertices() < wanted; ++it)
      if (mesh_.length2(it->second) == it->first) split(it->second);
  }
}

void Remesher::remove_low_valences() {
  for (int v = 0; v < mesh_.slots(); ++v) {
    if (!mesh_.vertex_alive(v) || mesh_.valence(v) > 4) continue;
    int best = mesh_.out(v);
    mesh_.around(v, [&](int h) {
      if (mesh_.valence(mesh_.to(h)) < mesh_.valence(mesh_.to(best))) best = h;
    });
    collapse(best, 1.8 * edge_m_);
  }
}

}  // namespace geocage::stages
