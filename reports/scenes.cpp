#include "reports/scenes.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace geocage::reports {

namespace {

using std::numbers::pi;

void append(Part& to, const Part& more) {
  const int first = static_cast<int>(to.mesh.vertices.size());
  to.mesh.vertices.insert(to.mesh.vertices.end(), more.mesh.vertices.begin(), more.mesh.vertices.end());
  to.normals.insert(to.normals.end(), more.normals.begin(), more.normals.end());
  to.colours.insert(to.colours.end(), more.colours.begin(), more.colours.end());
  for (const auto& [a, b, c] : more.mesh.triangles)
    to.mesh.triangles.push_back({first + a, first + b, first + c});
}

}  // namespace

Part coloured_surface(const TriangleMesh& mesh, const std::vector<double>& values, const Scale& scale) {
  Part part{mesh, {}, {}};
  for (double value : values) part.colours.push_back(scale.at(value));
  return part;
}

Part capsule_part(const Vec3& a, const Vec3& b, double radius_m, const Colour& colour) {
  constexpr int around = 32, rings = 8;  // rings of a half ball
  const Vec3 z = (b - a).norm() > 0 ? (b - a).normalized() : Vec3::UnitZ();
  const Vec3 x = z.unitOrthogonal(), y = z.cross(x);
  Part part;
  for (int i = 0; i <= 2 * rings + 1; ++i) {  // the two equators are rows of their own
    const bool lower = i <= rings;
    const double latitude = pi / 2 * (lower ? i - rings : i - rings - 1) / rings;
    for (int j = 0; j < around; ++j) {
      const double angle = 2 * pi * j / around;
      const Vec3 n =
          std::cos(latitude) * (std::cos(angle) * x + std::sin(angle) * y) + std::sin(latitude) * z;
      part.mesh.vertices.push_back((lower ? a : b) + radius_m * n);
      part.normals.push_back(n);
      part.colours.push_back(colour);
    }
  }
  for (int i = 0; i <= 2 * rings; ++i)
    for (int j = 0; j < around; ++j) {
      const int p = i * around + j, q = i * around + (j + 1) % around;
      part.mesh.triangles.push_back({p, q, q + around});
      part.mesh.triangles.push_back({p, q + around, p + around});
    }
  return part;
}

Part ball_part(const std::vector<Vec3>& centers, double radius_m, const Colour& colour) {
  Part balls;
  for (const Vec3& center : centers) append(balls, capsule_part(center, center, radius_m, colour));
  return balls;
}

Part point_part(const std::vector<Vec3>& points, const std::vector<Vec3>& normals, double size_m,
                const std::vector<Colour>& colours) {
  Part squares;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Vec3 n = normals.empty() ? Vec3::UnitZ() : normals[i];
    const Vec3 x = size_m / 2 * n.unitOrthogonal(), y = n.cross(x);
    append(squares, {{{points[i] - x, points[i] - y, points[i] + x, points[i] + y}, {{0, 1, 2}, {0, 2, 3}}},
                     std::vector<Colour>(4, colours[i]),
                     std::vector<Vec3>(4, n)});
  }
  return squares;
}

Part hand_part(const hands::Hand& hand, const geometry::Pose& X_OH, const Eigen::VectorXd& q) {
  const auto placed = hands::placed_capsules(hand, X_OH, q);
  const Colour palm = oklch(0.42, 0.015, 250), finger = oklch(0.86, 0.012, 250);
  Part part;
  for (std::size_t i = 0; i < placed.size(); ++i) {
    const bool of_finger = std::ranges::any_of(hand.fingers, [&](const hands::Finger& f) {
      return std::ranges::count(f.links, hand.capsules[i].link) > 0;
    });
    append(part, capsule_part(placed[i].a, placed[i].b, placed[i].radius_m, of_finger ? finger : palm));
  }
  return part;
}

View clearest_view(const Studio& studio, const Vec3& up) {
  constexpr int turns = 12;
  const Vec3 z = up.normalized(), x = z.unitOrthogonal(), y = z.cross(x);
  std::vector<View> views;
  for (double lift : {0.35, 0.7})
    for (int i = 0; i < turns; ++i) {
      const double angle = 2 * pi * i / turns;
      views.push_back({std::cos(lift) * (std::cos(angle) * x + std::sin(angle) * y) + std::sin(lift) * z, z});
    }
  std::vector<std::vector<int>> rays;
  rays.reserve(views.size());
  for (const View& view : views) rays.push_back(studio.rays_on_parts(view));
  const auto clearness = [&](std::size_t view) {
    double product = 1;
    for (std::size_t part = 0; part < rays[view].size(); ++part) {
      int most = 1;
      for (const auto& counts : rays) most = std::max(most, counts[part]);
      product *= static_cast<double>(rays[view][part]) / most;
    }
    return product;
  };
  std::size_t best = 0;
  for (std::size_t view = 1; view < views.size(); ++view)
    if (clearness(view) > clearness(best)) best = view;
  return views[best];
}

}  // namespace geocage::reports
