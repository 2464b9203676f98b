#include "tests/stages/import/table_scenes.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <memory>
#include <random>

#include "datasets/shapes.h"
#include "geometry/mesh_files.h"
#include "geometry/surface_distance.h"
#include "stages/scan/scan.h"

namespace geocage::tests {

using geometry::TriangleMesh;
using geometry::Vec3;

namespace {

TriangleMesh placed(TriangleMesh mesh, const Vec3& at, double turn_rad = 0) {
  const Eigen::Matrix3d R = Eigen::AngleAxisd(turn_rad, Vec3::UnitZ()).toRotationMatrix();
  for (Vec3& p : mesh.vertices) p = R * p + at;
  return mesh;
}

TriangleMesh together(const std::vector<TriangleMesh>& meshes) {
  TriangleMesh all;
  for (const auto& mesh : meshes) {
    const int first = static_cast<int>(all.vertices.size());
    all.vertices.insert(all.vertices.end(), mesh.vertices.begin(), mesh.vertices.end());
    for (const auto& [a, b, c] : mesh.triangles) all.triangles.push_back({first + a, first + b, first + c});
  }
  return all;
}

/// Lowest point at z = 0, middle of the box over the origin.
TriangleMesh standing(TriangleMesh mesh) {
  const auto report = check_mesh(mesh);
  const Vec3 middle = (report.box_min + report.box_max) / 2;
  for (Vec3& p : mesh.vertices) p -= Vec3(middle.x(), middle.y(), report.box_min.z());
  return mesh;
}

/// Its z axis along y.
TriangleMesh lying(TriangleMesh mesh) {
  for (Vec3& p : mesh.vertices) p = Vec3(-p.x(), p.z(), p.y());
  return standing(mesh);
}

TriangleMesh cylinder(double radius_m, double height_m) {
  return standing(datasets::capped_cylinder(radius_m, height_m, 60));
}
TriangleMesh box(const Vec3& size_m) {
  return standing(datasets::box(size_m, 12));
}
TriangleMesh ball(double radius_m) {
  return standing(datasets::icosphere(radius_m, 4));
}

/// A cup with a ring through its wall: the ring's inner half hides in the wall and the hollow.
TriangleMesh mug(double radius_m = 0.04, double height_m = 0.1) {
  const TriangleMesh body = standing(datasets::cup(radius_m, height_m, 0.004, 60));
  TriangleMesh ring = datasets::torus(0.28 * height_m, 0.006, 40, 16);
  TriangleMesh half;
  for (Vec3& p : ring.vertices) p = Vec3(p.x(), p.z(), p.y());  // its axis along y
  for (auto& t : ring.triangles) std::swap(t[1], t[2]);
  half.vertices = ring.vertices;
  for (const auto& t : ring.triangles)
    if ((ring.vertices[t[0]] + ring.vertices[t[1]] + ring.vertices[t[2]]).x() > 0)
      half.triangles.push_back(t);
  return together({body, placed(half, {radius_m - 0.002, 0, height_m / 2})});
}

/// A profile (radius, height) from the axis up to the axis, turned about z.
TriangleMesh turned(const std::vector<std::pair<double, double>>& profile) {
  constexpr int around = 60;
  std::vector<std::pair<double, double>> fine;
  for (std::size_t k = 0; k + 1 < profile.size(); ++k) {
    const auto& [r, z] = profile[k];
    const auto& [s, w] = profile[k + 1];
    const int steps = std::max(1, static_cast<int>(std::hypot(s - r, w - z) / 0.004));
    for (int i = 0; i < steps; ++i) fine.emplace_back(r + (s - r) * i / steps, z + (w - z) * i / steps);
  }
  TriangleMesh mesh;
  mesh.vertices.emplace_back(0, 0, profile.front().second);
  for (std::size_t k = 1; k < fine.size(); ++k)
    for (int i = 0; i < around; ++i) {
      const double at = 2 * M_PI * i / around;
      mesh.vertices.emplace_back(fine[k].first * std::cos(at), fine[k].first * std::sin(at), fine[k].second);
    }
  const int rings = static_cast<int>(fine.size()) - 1, top = 1 + rings * around;
  mesh.vertices.emplace_back(0, 0, profile.back().second);
  for (int i = 0; i < around; ++i) {
    const int j = (i + 1) % around;
    mesh.triangles.push_back({0, 1 + j, 1 + i});
    for (int k = 0; k + 1 < rings; ++k) {
      const int a = 1 + k * around, b = a + around;
      mesh.triangles.push_back({a + i, a + j, b + i});
      mesh.triangles.push_back({a + j, b + j, b + i});
    }
    mesh.triangles.push_back({top, top - around + i, top - around + j});
  }
  return mesh;
}

TriangleMesh bottle(double radius_m, double height_m) {
  const double r = radius_m, h = height_m;
  return turned(
      {{0, 0}, {r, 0}, {r, 0.6 * h}, {0.8 * r, 0.68 * h}, {0.4 * r, 0.78 * h}, {0.4 * r, h}, {0, h}});
}
TriangleMesh bowl(double radius_m, double height_m) {
  const double r = radius_m, h = height_m, w = 0.004;
  return turned({{0, 0},
                 {0.5 * r, 0},
                 {0.8 * r, 0.35 * h},
                 {r, h},
                 {r - w, h},
                 {0.8 * r - w, 0.35 * h + w},
                 {0.5 * r - w, w},
                 {0, w}});
}
TriangleMesh cone(double radius_m, double height_m) {
  return turned({{0, 0}, {radius_m, 0}, {0.15 * radius_m, height_m}, {0, height_m}});
}

double height_m(const TriangleMesh& mesh) {
  return check_mesh(mesh).box_max.z();
}

double gap_m(const TriangleMesh& a, const geometry::SurfaceDistance& to_a, const TriangleMesh& b) {
  const geometry::SurfaceDistance to_b(b);
  double gap = 1;
  int near = 0;
  for (const Vec3& p : b.vertices) gap = std::min(gap, to_a.distance_m(p, near));
  near = 0;
  for (const Vec3& p : a.vertices) gap = std::min(gap, to_b.distance_m(p, near));
  return gap;
}

/// Least distance of points from a surface that they come nearer to, step by step: those that can't be nearer
/// than another yet are not asked.
class Approaching {
 public:
  Approaching(const std::vector<Vec3>& points, const TriangleMesh& to)
      : points_(points), to_(to), at_least_m_(points.size(), 0) {}

  /// After all points were moved by `by` from where they began, and by `step_m` from where they were.
  double gap_m(const Vec3& by, double step_m) {
    for (double& m : at_least_m_) m -= step_m;
    double gap = measure(nearest_, by);
    for (std::size_t i = 0; i < points_.size(); ++i)
      if (at_least_m_[i] < gap && measure(i, by) < gap) {
        nearest_ = i;
        gap = at_least_m_[i];
      }
    return gap;
  }

 private:
  double measure(std::size_t i, const Vec3& by) {
    return at_least_m_[i] = to_.distance_m(points_[i] + by, hint_);
  }

  const std::vector<Vec3>& points_;
  const geometry::SurfaceDistance to_;
  std::vector<double> at_least_m_;
  std::size_t nearest_ = 0;
  int hint_ = 0;
};

/// The mesh moved along -way from afar until it all but touches the others.
TriangleMesh pushed(const TriangleMesh& mesh, const std::vector<TriangleMesh>& others, double way_rad) {
  const Vec3 way(std::cos(way_rad), std::sin(way_rad), 0);
  const TriangleMesh group = together(others);
  Approaching to_group(mesh.vertices, group), to_mesh(group.vertices, mesh);
  double at = 0.5, step_m = 0;
  for (int step = 0; step < 60; ++step) {
    const double gap = std::min(to_group.gap_m(at * way, step_m), to_mesh.gap_m(-at * way, step_m));
    if (gap < 0.001 || at < 0) break;
    step_m = 0.9 * gap;  // no point moves farther than the gap: they never pass through each other
    at -= step_m;
  }
  return placed(mesh, at * way);
}

/// Meshes of the folder that stand well, turned.
TriangleMesh from(const std::filesystem::path& objects, const std::string& file, double turn_rad = 0) {
  return placed(standing(geometry::read_mesh(objects / file, file == "elephant.off" ? 0.14 : 1)),
                Vec3::Zero(), turn_rad);
}

std::vector<TableScene> tuning(const std::filesystem::path& objects) {
  const auto tall = cylinder(0.033, 0.12);
  std::vector<TableScene> list = {
      {"a mug", {mug()}},
      {"a mug with its handle to the sensor", {placed(mug(), {0, 0, 0}, M_PI)}},
      {"a mug with its handle aside", {placed(mug(), {0, 0, 0}, M_PI / 2)}},
      {"mug and box touch",
       {placed(mug(), {0, 0.04, 0}, 2), placed(box({0.08, 0.06, 0.12}), {0, -0.035, 0})}},
      {"cylinders touch",
       {placed(tall, {0, 0.033, 0}), placed(tall, {0, -0.033, 0}), placed(tall, {-0.058, 0, 0})}},
      {"boxes touch",
       {placed(box({0.08, 0.08, 0.15}), {0, 0.041, 0}), placed(box({0.1, 0.07, 0.06}), {0, -0.036, 0}, 0.1)}},
      {"a can on a box", {box({0.12, 0.1, 0.06}), placed(cylinder(0.035, 0.1), {0, 0, 0.06})}},
      {"apart",
       {placed(mug(), {0, 0.15, 0}), placed(tall, {0, 0, 0}),
        placed(box({0.08, 0.06, 0.1}), {0.1, -0.15, 0})}},
      {"ring", {standing(datasets::torus(0.05, 0.018, 60, 24))}},
      {"a ball at a can", {placed(ball(0.04), {-0.07, 0, 0}), cylinder(0.033, 0.12)}},
  };
  if (!objects.empty())
    for (const char* name : {"mug.stl", "bunny.stl", "duck.stl", "wineglass.stl", "ycb_pitcher.obj",
                             "hammer.stl", "banana.stl"}) {
      list.push_back({name, {from(objects, name)}});
      const double reach = check_mesh(list.back().things[0]).box_max.y();
      list.push_back(
          {std::string(name) + " at a can", {list.back().things[0], placed(tall, {0, -reach - 0.033, 0})}});
    }
  return list;
}

std::vector<TableScene> held_out(const std::filesystem::path& objects) {
  const auto on = [](const TriangleMesh& upper, const TriangleMesh& lower, double x, double y, double turn) {
    return placed(upper, {x, y, height_m(lower)}, turn);
  };
  const auto book = box({0.15, 0.21, 0.025}), carton = box({0.07, 0.09, 0.17}), tin = cylinder(0.042, 0.08);
  std::vector<TableScene> list = {
      {"a bottle", {bottle(0.035, 0.22)}},
      {"a bowl", {bowl(0.08, 0.06)}},
      {"a cone", {cone(0.05, 0.12)}},
      {"a lying bottle", {placed(lying(bottle(0.03, 0.2)), Vec3::Zero(), 0.5)}},
      {"a cup", {standing(datasets::cup(0.035, 0.09, 0.003, 60))}},
      {"a carton askew", {placed(carton, Vec3::Zero(), 0.6)}},
      {"a mug on a book", {book, on(mug(), book, 0.01, 0.03, 2.5)}},
      {"two books", {book, on(box({0.12, 0.17, 0.03}), book, 0.01, 0.0, 0.4)}},
      {"a ball on a ring",
       {standing(datasets::torus(0.045, 0.015, 60, 24)), placed(ball(0.04), {0, 0, 0.007})}},
      {"three in a pile",
       {carton, on(box({0.06, 0.06, 0.05}), carton, 0, 0, 0.5), placed(cylinder(0.025, 0.06), {0, 0, 0.22})}},
      {"a lying can at a box", {}},
      {"bottles", {}},
      {"two mugs", {}},
      {"a bowl at a mug", {}},
      {"a cone at a carton", {}},
      {"four", {}},
  };
  const auto push = [&](const std::string& name, std::vector<TriangleMesh> things, std::vector<double> ways) {
    for (auto& scene : list)
      if (scene.name == name) {
        scene.things = {things[0]};
        for (std::size_t k = 1; k < things.size(); ++k)
          scene.things.push_back(pushed(things[k], scene.things, ways[k - 1]));
      }
  };
  push("a lying can at a box", {box({0.06, 0.14, 0.09}), lying(cylinder(0.033, 0.12))}, {M_PI});
  push("bottles", {bottle(0.035, 0.2), bottle(0.03, 0.23)}, {1.3});
  push("two mugs", {placed(mug(), Vec3::Zero(), 2.2), placed(mug(0.036, 0.09), Vec3::Zero(), -2)}, {-1.4});
  push("a bowl at a mug", {bowl(0.075, 0.055), placed(mug(), Vec3::Zero(), 1)}, {1.8});
  push("a cone at a carton", {carton, cone(0.045, 0.11)}, {-2});
  push("four", {carton, tin, ball(0.035), box({0.05, 0.05, 0.05})}, {1.6, -2.4, 2.6});
  if (!objects.empty()) {
    for (const char* name :
         {"airplane.stl", "elephant.off", "horse.ply", "torus.stl", "bunny.stl", "duck.stl"})
      list.push_back({name, {from(objects, name, 2.1)}});
    const std::vector<std::tuple<const char*, TriangleMesh, double>> pairs = {{"bunny.stl", carton, 1.2},
                                                                              {"mug.stl", tin, -1.5},
                                                                              {"torus.stl", ball(0.04), 2.5},
                                                                              {"banana.stl", tin, -1.9},
                                                                              {"ycb_pitcher.obj", carton, 2}};
    for (const auto& [name, other, way] : pairs) {
      TableScene scene{std::string(name) + " and a neighbour", {from(objects, name, 0.9)}};
      scene.things.push_back(pushed(other, scene.things, way));
      list.push_back(scene);
    }
  }
  return list;
}

/// Numbers from one seed, the same with any standard library.
class Chance {
 public:
  explicit Chance(std::uint64_t seed) : engine_(seed) {}
  double in(double low, double high) {
    return low + (high - low) * static_cast<double>(engine_() >> 11) * 0x1p-53;
  }
  int below(int n) { return static_cast<int>(engine_() % static_cast<std::uint64_t>(n)); }

 private:
  std::mt19937_64 engine_;
};

TriangleMesh thing_of_chance(Chance& chance, const std::filesystem::path& objects) {
  static const std::vector<const char*> files = {"mug.stl",   "bunny.stl",       "duck.stl",  "wineglass.stl",
                                                 "torus.stl", "ycb_pitcher.obj", "banana.stl"};
  switch (chance.below(objects.empty() ? 8 : 10)) {
    case 0:
    case 1:
      return box({chance.in(0.04, 0.1), chance.in(0.04, 0.12), chance.in(0.04, 0.18)});
    case 2:
    case 3:
      return cylinder(chance.in(0.025, 0.05), chance.in(0.05, 0.16));
    case 4:
      return ball(chance.in(0.03, 0.05));
    case 5:
      return mug(chance.in(0.033, 0.045), chance.in(0.08, 0.11));
    case 6:
      return bottle(chance.in(0.028, 0.04), chance.in(0.16, 0.24));
    case 7:
      return bowl(chance.in(0.06, 0.09), chance.in(0.045, 0.07));
    default:
      return from(objects, files[static_cast<std::size_t>(chance.below(static_cast<int>(files.size())))]);
  }
}

TableScene in_the_middle(TableScene scene) {
  const auto report = check_mesh(together(scene.things));
  Vec3 middle = (report.box_min + report.box_max) / 2;
  middle.z() = 0;
  for (auto& thing : scene.things) thing = placed(thing, -middle);
  return scene;
}

std::vector<TableScene> of_chance(const std::filesystem::path& objects, int first_seed) {
  std::vector<TableScene> list;
  for (int k = 0; k < 27; ++k) {
    Chance chance(static_cast<std::uint64_t>(first_seed + k));
    TableScene scene{"chance " + std::to_string(k), {}};
    const int count = 1 + chance.below(4);
    for (int i = 0; i < count; ++i) {
      const auto thing = placed(thing_of_chance(chance, objects), Vec3::Zero(), chance.in(0, 2 * M_PI));
      const double way = chance.in(0, 2 * M_PI);
      if (scene.things.empty())
        scene.things.push_back(thing);
      else if (chance.below(5) == 0) {  // on the first: a book under it, where it has no flat top
        const auto book = box({0.16, 0.2, chance.in(0.02, 0.05)});
        scene.things.push_back(pushed(book, scene.things, way));
        const auto report = check_mesh(scene.things.back());
        const Vec3 middle = (report.box_min + report.box_max) / 2;
        scene.things.push_back(placed(thing, {middle.x(), middle.y(), report.box_max.z()}));
        break;
      } else
        scene.things.push_back(pushed(thing, scene.things, way));
    }
    list.push_back(in_the_middle(std::move(scene)));
  }
  return list;
}

/// A thing, and how far from its axis its top is flat: 0 where nothing can stand on it.
struct Stackable {
  TriangleMesh mesh;
  double flat_m;
};

Stackable wide_thing(Chance& chance, const std::filesystem::path& objects) {
  static const std::vector<const char*> files = {
      "mug.stl",    "bunny.stl", "duck.stl",     "wineglass.stl", "torus.stl",  "ycb_pitcher.obj",
      "banana.stl", "horse.ply", "elephant.off", "airplane.stl",  "hammer.stl", "scissors.stl"};
  const auto a_box = [&](double low, double high) -> Stackable {
    const Vec3 size(chance.in(0.04, 0.12), chance.in(0.04, 0.14), chance.in(low, high));
    return {box(size), 0.5 * std::min(size.x(), size.y())};
  };
  const auto a_can = [&]() -> Stackable {
    const double radius = chance.in(0.025, 0.05);
    return {cylinder(radius, chance.in(0.04, 0.16)), radius};
  };
  switch (chance.below(objects.empty() ? 11 : 15)) {
    case 0:
    case 1:
      return a_box(0.03, 0.18);
    case 2:
    case 3:
      return a_can();
    case 4: {
      const Vec3 size(chance.in(0.1, 0.16), chance.in(0.14, 0.22), chance.in(0.015, 0.05));
      return {box(size), 0.5 * size.x()};
    }
    case 5:
      return {ball(chance.in(0.025, 0.06)), 0};
    case 6:
      return {mug(chance.in(0.03, 0.05), chance.in(0.07, 0.13)), 0};
    case 7:
      return {bottle(chance.in(0.025, 0.045), chance.in(0.14, 0.26)), 0};
    case 8:
      return {bowl(chance.in(0.05, 0.1), chance.in(0.035, 0.09)), 0};
    case 9:
      return chance.below(2) == 0
                 ? Stackable{cone(chance.in(0.03, 0.06), chance.in(0.07, 0.16)), 0}
                 : Stackable{
                       standing(datasets::cup(chance.in(0.03, 0.045), chance.in(0.07, 0.12), 0.003, 60)), 0};
    case 10:
      return chance.below(2) == 0
                 ? Stackable{lying(cylinder(chance.in(0.025, 0.045), chance.in(0.07, 0.15))), 0}
                 : Stackable{lying(bottle(chance.in(0.025, 0.04), chance.in(0.14, 0.24))), 0};
    default: {
      auto mesh =
          from(objects, files[static_cast<std::size_t>(chance.below(static_cast<int>(files.size())))]);
      const double scale = chance.in(0.8, 1.2);
      for (Vec3& p : mesh.vertices) p *= scale;
      return {mesh, 0};
    }
  }
}

/// One to five things: against each other, or one on another's flat top.
std::vector<TableScene> wide(const std::filesystem::path& objects, int first_seed, Seeds seeds) {
  std::vector<TableScene> list;
  for (int k = seeds.from; k < seeds.to; ++k) {
    Chance chance(static_cast<std::uint64_t>(first_seed + k));
    TableScene scene{"wide " + std::to_string(k), {}};
    std::vector<double> flat;
    const int count = 1 + chance.below(5);
    for (int i = 0; i < count; ++i) {
      auto [mesh, flat_m] = wide_thing(chance, objects);
      mesh = placed(mesh, Vec3::Zero(), chance.in(0, 2 * M_PI));
      const double way = chance.in(0, 2 * M_PI);
      std::size_t below = 0;
      while (below < flat.size() && !(flat[below] > 0.03)) ++below;
      if (scene.things.empty()) {
        scene.things.push_back(mesh);
      } else if (below < flat.size() && chance.below(3) == 0) {
        const auto report = check_mesh(scene.things[below]);
        Vec3 at = (report.box_min + report.box_max) / 2;
        at.z() = report.box_max.z();
        scene.things.push_back(placed(mesh, at + 0.3 * flat[below] * Vec3(std::cos(way), std::sin(way), 0)));
        flat[below] = 0;
      } else {
        scene.things.push_back(pushed(mesh, scene.things, way));
      }
      flat.push_back(flat_m);
    }
    list.push_back(in_the_middle(std::move(scene)));
  }
  return list;
}

TriangleMesh stretched(TriangleMesh mesh, const Vec3& by) {
  for (Vec3& p : mesh.vertices) p = p.cwiseProduct(by);
  return mesh;
}

/// Things of several pieces, bent outlines and flat ones, and all of wide_thing, stretched. A block in one
/// with another is no other thing than a pile: `ambiguous`.
Stackable varied_thing(Chance& chance, const std::filesystem::path& objects, bool& ambiguous) {
  const int kind = chance.below(9);
  ambiguous = ambiguous || kind == 0 || kind == 4;
  switch (kind) {
    case 0: {  // spray: body, neck, head
      const double r = chance.in(0.025, 0.04), h = chance.in(0.12, 0.2);
      const double reach = chance.in(0.05, 0.09);
      return {together({cylinder(r, h), placed(cylinder(0.4 * r, 0.03), {0, 0, h}),
                        placed(box({reach, 0.6 * r, 0.03}), {0.2 * reach, 0, h + 0.025})}),
              0};
    }
    case 1: {  // pot with a stick or a lid's knob
      const double r = chance.in(0.04, 0.08), h = chance.in(0.04, 0.11);
      const auto body = chance.below(2) == 0 ? standing(datasets::cup(r, h, 0.004, 60)) : cylinder(r, h);
      const auto stick = box({chance.in(0.06, 0.14), 0.02, 0.015});
      const double out = r + check_mesh(stick).box_max.x() - 0.003;
      return {together({body, placed(stick, {out, 0, 0.8 * h})}), 0};
    }
    case 2: {  // plate, deep or flat
      return {bowl(chance.in(0.07, 0.12), chance.in(0.018, 0.035)), 0};
    }
    case 3: {  // beaker, wider at its top
      const double r = chance.in(0.03, 0.045), h = chance.in(0.08, 0.15), w = 0.003;
      return {turned({{0, 0}, {0.7 * r, 0}, {r, h}, {r - w, h}, {0.7 * r - w, w}, {0, w}}), 0};
    }
    case 4: {  // two blocks in one, as a drill or an iron has
      const Vec3 low(chance.in(0.08, 0.14), chance.in(0.05, 0.08), chance.in(0.03, 0.06));
      const Vec3 high(chance.in(0.03, 0.06), chance.in(0.03, 0.05), chance.in(0.06, 0.12));
      const double x = chance.in(-0.5, 0.5) * (low.x() - high.x());
      return {together({box(low), placed(box(high), {x, 0, low.z() - 0.002})}), 0};
    }
    case 5: {  // a jug or a lying mug
      auto mesh = mug(chance.in(0.04, 0.06), chance.in(0.12, 0.2));
      if (chance.below(2) == 0) mesh = lying(placed(mesh, Vec3::Zero(), chance.in(0, 2 * M_PI)));
      return {mesh, 0};
    }
    default: {
      auto thing = wide_thing(chance, objects);
      const Vec3 by(chance.in(0.8, 1.25), chance.in(0.8, 1.25), chance.in(0.8, 1.25));
      return {stretched(thing.mesh, by), thing.flat_m * std::min(by.x(), by.y())};
    }
  }
}

/// How many things, and from where they are seen.
struct Crowd {
  int least = 1, most = 6;
  double low_deg = 28, high_deg = 62, near_m = 0.7, far_m = 1;
};

/// Things against each other, a little apart, or on the flat top of any; each scene from one place of chance.
/// Scenes with something ambiguous are left out.
std::vector<TableScene> varied(const std::filesystem::path& objects, int first_seed, Seeds seeds,
                               const Crowd& crowd = {}) {
  std::vector<TableScene> list;
  for (int k = seeds.from; k < seeds.to; ++k) {
    Chance chance(static_cast<std::uint64_t>(first_seed + k));
    TableScene scene{"varied " + std::to_string(k), {}, {}};
    std::vector<double> flat;
    bool ambiguous = false;
    const int count = crowd.least + chance.below(crowd.most - crowd.least + 1);
    for (int i = 0; i < count; ++i) {
      auto [mesh, flat_m] = varied_thing(chance, objects, ambiguous);
      if (ambiguous) break;
      mesh = placed(mesh, Vec3::Zero(), chance.in(0, 2 * M_PI));
      const double way = chance.in(0, 2 * M_PI);
      std::vector<std::size_t> below;
      for (std::size_t j = 0; j < flat.size(); ++j)
        if (flat[j] > 0.025) below.push_back(j);
      if (scene.things.empty()) {
        scene.things.push_back(mesh);
        flat.push_back(flat_m);
        continue;
      }
      bool on_top = !below.empty() && chance.below(3) == 0;
      if (on_top) {
        const auto under = below[static_cast<std::size_t>(chance.below(static_cast<int>(below.size())))];
        const auto report = check_mesh(scene.things[under]);
        Vec3 at = (report.box_min + report.box_max) / 2;
        at.z() = report.box_max.z();
        const double aside = chance.in(0, 0.5) * flat[under];
        const auto upper = placed(mesh, at + aside * Vec3(std::cos(way), std::sin(way), 0));
        auto others = scene.things;
        others.erase(others.begin() + static_cast<std::ptrdiff_t>(under));
        // Vertices are less than 12 mm apart: what passes through another comes that near to it.
        on_top = others.empty() ||
                 gap_m(together(others), geometry::SurfaceDistance(together(others)), upper) > 0.006;
        if (on_top) {
          scene.things.push_back(upper);
          flat[under] = 0;
        }
      }
      if (!on_top) {
        const double apart = chance.below(3) == 0 ? chance.in(0, 0.02) : 0;
        scene.things.push_back(
            placed(pushed(mesh, scene.things, way), apart * Vec3(std::cos(way), std::sin(way), 0)));
      }
      flat.push_back(flat_m);
    }
    if (ambiguous) continue;
    scene = in_the_middle(std::move(scene));
    scene.views = {{chance.in(crowd.low_deg, crowd.high_deg), chance.in(crowd.near_m, crowd.far_m),
                    static_cast<std::uint64_t>(first_seed + k)}};
    list.push_back(std::move(scene));
  }
  return list;
}

/// How low tables may be, and whether more stands there: another table that carries something, too, and a
/// shelf over the table's back or behind it.
struct RoomRule {
  double lowest_m = 0.65;
  bool crowded = false;
};

/// A table of chance and what is seen round it: the floor always, walls behind or beside it, maybe against
/// it, the back of a chair, a box on the floor. Sensors look along +x, from above -x.
void put_in_a_room(TableScene& scene, Chance& chance, const RoomRule& rule) {
  scene.table_m = {chance.in(0.6, 0.9), chance.in(0.6, 1.2), chance.in(0.02, 0.04)};
  const double floor = -chance.in(rule.lowest_m, 0.85), back = scene.table_m.x() / 2,
               side = scene.table_m.y() / 2;
  const auto put = [&](const Vec3& size, const Vec3& foot) {
    scene.room.push_back(placed(standing(datasets::box(size, 12)), foot));
  };
  put({6, 6, 0.02}, {0, 0, floor - 0.02});
  for (double way : {-1, 1})  // out of sight: sensors aim at the middle of the box round everything
    put({0.01, 0.01, 0.01}, way * Vec3(3.2, 3.2, 2.6));
  if (chance.below(10) < 7)
    put({0.02, 6, 2.4}, {back + 0.01 + (chance.below(3) == 0 ? 0 : chance.in(0.02, 0.9)), 0, floor});
  if (chance.below(10) < 3) {
    const double way = chance.below(2) == 0 ? -1 : 1;
    put({6, 0.02, 2.4}, {0, way * (side + 0.01 + chance.in(0, 0.4)), floor});
  }
  if (chance.below(10) < 4)
    put({0.03, 0.42, chance.in(0.1, 0.4) - floor},
        {back + chance.in(0.04, 0.3), chance.in(-0.3, 0.3), floor});
  if (chance.below(10) < 5)
    put({chance.in(0.2, 0.4), chance.in(0.2, 0.4), chance.in(0.1, 0.5)},
        {chance.in(-0.3, 0.3), (chance.below(2) == 0 ? -1 : 1) * (side + chance.in(0.25, 0.4)), floor});
  if (!rule.crowded) return;
  if (chance.below(10) < 4) {
    const double y = (chance.below(2) == 0 ? -1 : 1) * (side + 0.35 + chance.in(0.05, 0.4));
    const double x = chance.in(-0.2, 0.5), top = chance.in(-0.15, 0.1);
    put({0.7, 0.7, 0.03}, {x, y, top - 0.03});
    put({0.12, 0.08, chance.in(0.05, 0.2)}, {x + chance.in(-0.1, 0.1), y, top});
  }
  if (chance.below(10) < 3)
    put({0.25, 1, 0.02}, {back + chance.in(-0.1, 0.3), chance.in(-0.2, 0.2), chance.in(0.35, 0.6)});
}

std::vector<TableScene> rooms(const std::filesystem::path& objects, int first_seed, Seeds seeds,
                              const Crowd& crowd = {}, const RoomRule& rule = {}) {
  auto list = varied(objects, first_seed, seeds, crowd);
  for (TableScene& scene : list) {
    Chance chance(scene.views.front().seed + 1000000);
    put_in_a_room(scene, chance, rule);
  }
  return list;
}

}  // namespace

std::vector<TableScene> table_scenes(const std::string& set, const std::filesystem::path& objects,
                                     Seeds seeds) {
  const auto of = [&](int count) { return Seeds{seeds.from, std::min(seeds.to, count)}; };
  if (set == "tuning") return tuning(objects);
  if (set == "held_out") return held_out(objects);
  if (set == "training") return wide(objects, 20000, of(240));
  if (set == "training_varied") return varied(objects, 80000, of(2400));
  if (set == "training_low") return varied(objects, 500000, of(2400), {3, 6, 28, 42});
  if (set == "trial") return varied(objects, 300000, of(160));
  if (set == "varied") return varied(objects, 200000, of(160));
  if (set == "varied_2") return varied(objects, 400000, of(160));
  if (set == "rooms") return rooms(objects, 600000, of(100));
  if (set == "rooms_trial") return rooms(objects, 500000, of(100));
  const Crowd far = {1, 6, 22, 60, 0.9, 1.3};
  if (set == "far_rooms") return rooms(objects, 800000, of(100), far, {0.35, true});
  if (set == "far_rooms_trial") return rooms(objects, 700000, of(100), far, {0.35, true});
  if (set == "varied_3") return varied(objects, 600000, of(200));
  if (set == "wide") return wide(objects, 50000, of(40));
  return of_chance(objects, set == "fresh" ? 1000 : 9000);
}

void write_seen(const TableScene& scene, const View& view, const std::filesystem::path& file) {
  auto all = scene.things;
  all.push_back(placed(standing(datasets::box(scene.table_m)), {0, 0, -scene.table_m.z()}));
  all.insert(all.end(), scene.room.begin(), scene.room.end());
  const double up = view.elevation_deg * M_PI / 180;
  const Vec3 sensor = view.distance_m * Vec3(-std::cos(up), 0, std::sin(up));
  stages::ScanParams params;
  params.placement = "list";
  params.positions_m = {sensor.x(), sensor.y(), sensor.z()};
  params.width = 640;
  params.height = 480;
  params.intrinsics = "field_of_view";
  params.noise = {"kinect"};
  params.range_max_m = 4;
  params.seed = view.seed;
  pipeline::Run run;
  const auto cloud = stages::scan(params, run, together(all));
  std::vector<std::unique_ptr<geometry::SurfaceDistance>> surfaces;
  for (const auto& mesh : all) surfaces.push_back(std::make_unique<geometry::SurfaceDistance>(mesh));
  std::ofstream out(file);
  out << "VERSION .7\nFIELDS x y z label\nSIZE 4 4 4 4\nTYPE F F F U\nCOUNT 1 1 1 1\nWIDTH " << cloud.size()
      << "\nHEIGHT 1\nVIEWPOINT " << sensor.transpose() << " 1 0 0 0\nPOINTS " << cloud.size()
      << "\nDATA ascii\n";
  for (const Vec3& p : cloud.points) {
    std::size_t label = 0;
    double least = 1;
    // Lower is the table or of no matter, and nothing reaches farther over its border.
    const bool over = 2 * std::abs(p.x()) < scene.table_m.x() + 0.2 &&
                      2 * std::abs(p.y()) < scene.table_m.y() + 0.2 && p.z() > 0.008;
    for (std::size_t k = 0; k < surfaces.size() && over; ++k) {
      int nearest = 0;
      if (const double d = surfaces[k]->distance_m(p, nearest); d < least) {
        least = d;
        label = k + 1;
      }
    }
    out << p.transpose() << " " << (label > scene.things.size() ? 0 : label) << "\n";
  }
}

}  // namespace geocage::tests
