#include "stages/remesh/isotropic.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "geometry/surface_distance.h"
#include "stages/remesh/halfedges.h"

namespace geocage::stages {

using geometry::SurfaceDistance;
using geometry::TriangleMesh;
using geometry::Vec3;

namespace {

double cos_between(const Vec3& a, const Vec3& b) {
  const double n2 = a.squaredNorm() * b.squaredNorm();
  return n2 > 0 ? a.dot(b) / std::sqrt(n2) : -1;
}

class Remesher {
 public:
  Remesher(const TriangleMesh& input, int vertices) : source_(input), mesh_(input), wanted_(vertices) {
    const auto report = check_mesh(input);
    edge_m_ = std::sqrt(report.area_m2 / vertices / (std::sqrt(3.0) / 2));
    near_.assign(mesh_.slots(), 0);
    for (int h = 0; h < mesh_.halfedges(); ++h) near_[mesh_.from(h)] = h / 3;
  }

  TriangleMesh run(int sweeps) {
    double h = edge_m_;
    for (int s = 0; s < sweeps; ++s) {
      split_long(4.0 / 3 * h);
      collapse_short(4.0 / 5 * h);
      flip_for_valence();
      relax(1, 1.0);
      relax(1, 1.0);
      h *= std::sqrt(std::clamp(double(mesh_.vertices()) / wanted_, 0.5, 2.0));
    }
    for (int s = 0; s < 4; ++s) {
      remove_odd_valences();
      meet_count();
      flip_for_valence();
      relax(4, 1.0);
      flip_for_angle();
    }
    flip_for_valence();
    relax(10, 1.0);
    for (int s = 0; s < 5; ++s) {
      flip_for_angle();
      polish(33 * M_PI / 180);
    }
    return mesh_.mesh();
  }

 private:
  std::vector<std::pair<double, int>> edges(double low2, double high2) const {
    std::vector<std::pair<double, int>> list;
    for (int h = 0; h < mesh_.halfedges(); ++h) {
      if (!mesh_.alive(h) || h > mesh_.twin(h)) continue;
      const double l2 = mesh_.length2(h);
      if (l2 >= low2 && l2 <= high2) list.emplace_back(l2, h);
    }
    std::sort(list.begin(), list.end());
    return list;
  }

  void split_edge(int h) {
    const int near = near_[mesh_.from(h)];
    const Vec3 middle = (mesh_.position[mesh_.from(h)] + mesh_.position[mesh_.to(h)]) / 2;
    mesh_.split(h, middle);
    near_.push_back(near);
  }

  void split_long(double longest) {
    for (int pass = 0; pass < 12; ++pass) {
      auto list = edges(longest * longest, 1e300);
      if (list.empty()) return;
      for (auto it = list.rbegin(); it != list.rend(); ++it)
        if (mesh_.length2(it->second) >= longest * longest) split_edge(it->second);
    }
  }

  bool try_collapse(int h, double longest, bool force_end = false) {
    if (!mesh_.can_collapse(h)) return false;
    const int a = mesh_.from(h), b = mesh_.to(h);
    const int c = mesh_.opposite(h), d = mesh_.opposite(mesh_.twin(h));
    if (mesh_.valence(a) + mesh_.valence(b) - 4 > 8) return false;
    (void)c;
    (void)d;
    std::array<int, 2> ends;
    const int fa = folds(a, ends), fb = folds(b, ends);
    if (fa > fb || (fa == fb && fa > 2)) return false;
    if (fa >= 2 && fb >= 2 && !folded(h)) return false;
    const Vec3 target =
        force_end || fb > fa ? mesh_.position[b] : Vec3((mesh_.position[a] + mesh_.position[b]) / 2);
    bool good = true;
    for (int v : {a, b})
      mesh_.around(v, [&](int x) {
        const int to = mesh_.to(x), opp = mesh_.opposite(x);
        if (to == a || to == b) return;
        if ((mesh_.position[to] - target).squaredNorm() > longest * longest) good = false;
        if (opp == a || opp == b) return;
        const Vec3 before = mesh_.double_area_normal(x), after = mesh_.double_area_normal_with(x, v, target);
        if (cos_between(before, after) < 0.5 && before.norm() > 1e-3 * edge_m_ * edge_m_) good = false;
        if (after.norm() < 1e-3 * edge_m_ * edge_m_) good = false;
      });
    if (!good) return false;
    mesh_.collapse(h);
    mesh_.position[b] = target;
    return true;
  }

  void collapse_short(double shortest) {
    for (int pass = 0; pass < 12; ++pass) {
      auto list = edges(0, shortest * shortest);
      int done = 0;
      for (const auto& [l2, h] : list)
        if (mesh_.alive(h) && mesh_.length2(h) <= shortest * shortest)
          done += try_collapse(h, 4.0 / 3 * edge_m_) ||
                  (mesh_.alive(h) && try_collapse(mesh_.twin(h), 4.0 / 3 * edge_m_));
      if (done < static_cast<int>(list.size()) / 50 || done == 0) return;
    }
  }

  void meet_count() {
    if (mesh_.vertices() > wanted_) {
      for (const auto& [l2, h] : edges(0, 1e300)) {
        if (mesh_.vertices() <= wanted_) break;
        if (mesh_.alive(h) && mesh_.length2(h) <= l2 * 1.0001)
          try_collapse(h, 1.6 * edge_m_) || try_collapse(mesh_.twin(h), 1.6 * edge_m_);
      }
    } else {
      auto list = edges(0, 1e300);
      for (auto it = list.rbegin(); it != list.rend() && mesh_.vertices() < wanted_; ++it)
        if (mesh_.length2(it->second) >= it->first * 0.9999) split_edge(it->second);
    }
  }

  void remove_odd_valences() {
    for (int v = 0; v < mesh_.slots(); ++v) {
      if (!mesh_.vertex_alive(v) || mesh_.valence(v) > 4) continue;
      int best = -1, least = 100;
      mesh_.around(v, [&](int h) {
        const int score = mesh_.valence(mesh_.to(h));
        if (score < least) {
          least = score;
          best = h;
        }
      });
      try_collapse(best, 1.8 * edge_m_, true);
    }
  }

  bool flip_keeps_shape(int h) const {
    const int g = mesh_.twin(h);
    const Vec3 n1 = mesh_.double_area_normal(h), n2 = mesh_.double_area_normal(g);
    const Vec3 &a = mesh_.position[mesh_.from(h)], &b = mesh_.position[mesh_.to(h)],
               &c = mesh_.position[mesh_.opposite(h)], &d = mesh_.position[mesh_.opposite(g)];
    const Vec3 m1 = (d - a).cross(c - a), m2 = (c - b).cross(d - b);
    const double before = cos_between(n1, n2), after = cos_between(m1, m2);
    return !folded(h) && after > std::min(0.7, before) && after > 0 && cos_between(m1, n1 + n2) > 0.5 &&
           cos_between(m2, n1 + n2) > 0.5;
  }

  void flip_for_valence() {
    const auto off = [&](int v, int change) { return std::pow(mesh_.valence(v) + change - 6, 2); };
    for (int pass = 0; pass < 4; ++pass) {
      int done = 0;
      for (int h = 0; h < mesh_.halfedges(); ++h) {
        if (!mesh_.alive(h) || h > mesh_.twin(h)) continue;
        const int a = mesh_.from(h), b = mesh_.to(h), c = mesh_.opposite(h),
                  d = mesh_.opposite(mesh_.twin(h));
        const double gain =
            off(a, 0) + off(b, 0) + off(c, 0) + off(d, 0) - off(a, -1) - off(b, -1) - off(c, 1) - off(d, 1);
        if (gain <= 0 || !mesh_.can_flip(h) || !flip_keeps_shape(h)) continue;
        // A flip must not make a fold of a long thin quad: its new edge stays under twice the old one.
        if ((mesh_.position[c] - mesh_.position[d]).squaredNorm() > 4 * mesh_.length2(h)) continue;
        mesh_.flip(h);
        ++done;
      }
      if (done == 0) return;
    }
  }

  static double min_angle(const Vec3& a, const Vec3& b, const Vec3& c) {
    const Vec3 x = b - a, y = c - b, z = a - c;
    const double area2 = x.cross(-z).norm();
    return std::min(
        {std::atan2(area2, -x.dot(z)), std::atan2(area2, -y.dot(x)), std::atan2(area2, -z.dot(y))});
  }
  double min_angle(int h) const {
    return min_angle(mesh_.position[mesh_.from(h)], mesh_.position[mesh_.to(h)],
                     mesh_.position[mesh_.opposite(h)]);
  }

  /// Flips where the smaller angle grows clearly.
  void flip_for_angle() {
    for (int h = 0; h < mesh_.halfedges(); ++h) {
      if (!mesh_.alive(h) || h > mesh_.twin(h)) continue;
      const int g = mesh_.twin(h);
      const double before = std::min(min_angle(h), min_angle(g));
      if (before > 38 * M_PI / 180) continue;
      const Vec3 &a = mesh_.position[mesh_.from(h)], &b = mesh_.position[mesh_.to(h)],
                 &c = mesh_.position[mesh_.opposite(h)], &d = mesh_.position[mesh_.opposite(g)];
      if (std::min(min_angle(a, d, c), min_angle(b, c, d)) <= before + 0.02) continue;
      if (mesh_.can_flip(h) && flip_keeps_shape(h)) mesh_.flip(h);
    }
  }

  /// True when no triangle around v turns by more than 60 degrees if v moves to p.
  bool keeps_faces(int v, const Vec3& p) const {
    bool good = true;
    mesh_.around(v, [&](int h) {
      const Vec3 before = mesh_.double_area_normal(h), after = mesh_.double_area_normal_with(h, v, p);
      if (cos_between(before, after) < 0.5 && before.norm() > 1e-3 * edge_m_ * edge_m_) good = false;
    });
    return good;
  }

  Vec3 projected(const Vec3& p, const Vec3& normal, int v) {
    ++queries_;
    auto foot = source_.foot_facing(p, normal, 0.7, edge_m_, near_[v]);
    if (!foot) foot = source_.foot_facing(p, normal, 0, edge_m_, near_[v]);
    return foot ? foot->point_O : source_.foot(p, near_[v]).point_O;
  }

  bool folded(int h) const {
    const Vec3 n1 = mesh_.double_area_normal(h), n2 = mesh_.double_area_normal(mesh_.twin(h));
    const double small = 0.05 * edge_m_ * edge_m_;
    return n1.norm() > small && n2.norm() > small && cos_between(n1, n2) < 0.5;
  }
  int folds(int v, std::array<int, 2>& ends) const {
    int n = 0;
    mesh_.around(v, [&](int h) {
      if (!folded(h)) return;
      if (n < 2) ends[n] = mesh_.to(h);
      ++n;
    });
    return n;
  }

  void relax(int rounds, double step) {
    for (int round = 0; round < rounds; ++round)
      for (int v = 0; v < mesh_.slots(); ++v) {
        if (!mesh_.vertex_alive(v)) continue;
        Vec3 sum = Vec3::Zero(), normal = Vec3::Zero();
        double weight = 0;
        const Vec3 p = mesh_.position[v];
        mesh_.around(v, [&](int h) {
          const Vec3 n = mesh_.double_area_normal(h);
          const double area = n.norm();
          sum += area * (mesh_.position[mesh_.to(h)] + mesh_.position[mesh_.opposite(h)] + p) / 3;
          normal += n;
          weight += area;
        });
        if (!(weight > 0) || normal.squaredNorm() == 0) continue;
        normal.normalize();
        Vec3 move = step * 1.5 * (sum / weight - p);
        move -= normal.dot(move) * normal;
        std::array<int, 2> ends;
        const int count = folds(v, ends);
        if (count == 2) {
          const Vec3 x = mesh_.position[ends[0]], y = mesh_.position[ends[1]];
          const Vec3 along = (y - x).normalized();
          move = along * along.dot((x + y) / 2 - p) * 0.5;
        } else if (count > 2)
          move.setZero();
        for (int half = 0; half < 2; ++half, move /= 2) {
          const Vec3 q = projected(p + move, normal, v);
          if (!keeps_faces(v, q)) continue;
          mesh_.position[v] = q;
          break;
        }
      }
  }

  double ring_angle(int v, const Vec3& p) const {
    double least = 10;
    mesh_.around(v, [&](int h) {
      least = std::min(least, min_angle(p, mesh_.position[mesh_.to(h)], mesh_.position[mesh_.opposite(h)]));
    });
    return least;
  }

  /// Moves the corners of triangles with an angle below `bad` uphill.
  void polish(double bad) {
    std::vector<int> corners;
    for (int h = 0; h < mesh_.halfedges(); h += 3)
      if (mesh_.alive(h) && min_angle(h) < bad)
        for (int i = 0; i < 3; ++i) corners.push_back(mesh_.from(h + i));
    std::sort(corners.begin(), corners.end());
    corners.erase(std::unique(corners.begin(), corners.end()), corners.end());
    for (int v : corners) {
      Vec3 normal = Vec3::Zero();
      mesh_.around(v, [&](int h) { normal += mesh_.double_area_normal(h); });
      normal.normalize();
      const Vec3 x = normal.unitOrthogonal(), y = normal.cross(x);
      double best = ring_angle(v, mesh_.position[v]);
      for (double step = 0.15 * edge_m_; step > 0.01 * edge_m_; step /= 2)
        for (int k = 0; k < 8; ++k) {
          const double at = k * M_PI / 4;
          const Vec3 q =
              projected(mesh_.position[v] + step * (std::cos(at) * x + std::sin(at) * y), normal, v);
          const double angle = ring_angle(v, q);
          if (angle <= best || !keeps_faces(v, q)) continue;
          best = angle;
          mesh_.position[v] = q;
        }
    }
  }

  const SurfaceDistance source_;
  Halfedges mesh_;
  std::vector<int> near_;
  const int wanted_;
  double edge_m_;
  long queries_ = 0;
};

}  // namespace

TriangleMesh isotropic(const TriangleMesh& mesh, int vertices, int sweeps) {
  return Remesher(mesh, vertices).run(sweeps);
}

}  // namespace geocage::stages
