// Are the outcomes Bullet's alone? Grasps made on noisy copies of every mesh of a folder, tested on the true
// mesh by Bullet (signed distance field) and by MuJoCo (convex parts), and cases whose answer is known:
//   mujoco_study FOLDER [--tier cage|force|known|all] [--noise M] [--seeds N] [--grasps N] [--hand NAME]
//                [--only a,b] [--part-mm T] [--mujoco-dt S] [--impratio R] [--ways N]
// --part-mm: how far a convex part may be outside the solid. --mujoco-dt: MuJoCo's step; its contacts have
// twice that as their time constant. --ways: how many of the six each grasp is pulled or pushed along, in
// turn. Rows and disagreements are printed object by object: a run that was cut is finished with --only.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <memory>
#include <numbers>

#include "physics/cage_trial.h"
#include "physics/force_trial.h"
#include "physics/formula_field.h"
#include "physics/locked_hand.h"
#include <fmt/format.h>

#include "tests/bench/mujoco_world.h"
#include "tests/bench/study_grasps.h"

namespace geocage::bench {
namespace {

using geometry::Pose;
using geometry::Vec3;
using physics::Outcome;

constexpr double deg = std::numbers::pi / 180;

struct Settings {
  MujocoSettings mujoco;
  physics::ConvexPartsRule parts;
  int ways = 6;  ///< of the six, in turn
};

double turn_of(const Pose& a, const Pose& b) {
  return Eigen::AngleAxisd(Eigen::Matrix3d(a.linear().transpose() * b.linear())).angle();
}

/// What one engine says of a trial.
struct Seen {
  Outcome outcome = Outcome::held;
  double moved_m = 0, turned_rad = 0, ended_s = 0, penetration_m = 0;
};

/// The pull of the cage test, in MuJoCo.
Seen mujoco_pull(const Settings& settings, const physics::LockedHand& locked, const physics::ObjectBody& body,
                 MujocoWorld& world, const Vec3& way) {
  const physics::CageProtocol& protocol = locked.protocol;
  world.reset();
  const Pose start = world.X_WO();
  const Vec3 center = body.X_OB.translation();
  const double dt = settings.mujoco.dt_s, kept = std::exp(-dt / protocol.engine.damping_s);
  const int steps = static_cast<int>(std::lround(protocol.pull_s / dt)), look = std::lround(0.05 / dt);
  int resting = 0;
  Seen seen;
  for (int i = 1; i <= steps; ++i) {
    world.step(body.mass_kg * protocol.gravity_m_s2 * way);
    world.damp(kept);
    const Pose X = world.X_WO();
    seen.ended_s = i * dt, seen.penetration_m = std::max(seen.penetration_m, world.penetration_m());
    seen.moved_m = std::max(seen.moved_m, (X * center - start * center).norm());
    seen.turned_rad = std::max(seen.turned_rad, turn_of(start, X));
    if (!world.finite() || seen.penetration_m > protocol.max_penetration_m)
      return seen.outcome = Outcome::error, seen;
    if (i % look == 0 &&
        (locked.escape.gone(X) || (locked.escape.beside(X) && locked.escape.straight_way_out(X))))
      return seen.outcome = Outcome::lost, seen;
    const bool rests =
        world.speed_m_s() < protocol.rest_speed_m_s && world.spin_rad_s() < protocol.rest_spin_rad_s;
    resting = rests ? resting + 1 : 0;
    if (resting * dt >= protocol.rest_s) break;
  }
  return seen;
}

/// `parts`: of the step.
Seen bullet_pull(const physics::LockedHand& locked, const physics::ObjectBody& body, const Vec3& way,
                 int parts = 1) {
  physics::CageProtocol protocol = locked.protocol;
  protocol.engine.dt_s /= parts;
  const auto trial = physics::pull_trial(protocol, body, locked.escape, way, 0);
  return {trial.outcome, trial.max_displacement_m, trial.max_rotation_rad, trial.ended_s,
          trial.penetration_m};
}

/// A push of the force test, in MuJoCo.
Outcome mujoco_push(const Settings& settings, const physics::Protocol& protocol,
                    const physics::ObjectBody& body, const std::vector<physics::ConvexPart>& parts,
                    const hands::Hand& hand, const physics::Posture& posture, const Vec3& way) {
  MujocoSettings mujoco = settings.mujoco;
  mujoco.friction = protocol.engine.friction;
  MujocoWorld world(mujoco, body, parts, hand, posture.X_OH, posture.q);
  world.hold(hand, physics::squeezed(hand, posture.q, protocol.grip), protocol.grip);
  Pose start = world.X_WO();
  const auto phase = [&](const Vec3& force, double seconds, double most_m, double most_rad) {
    const int steps = static_cast<int>(std::lround(seconds / mujoco.dt_s));
    const Vec3 center = body.X_OB.translation();
    for (int i = 0; i < steps; ++i) {
      world.step(force);
      if (!world.finite() ||
          world.penetration_m() > posture.penetration_m + protocol.max_penetration_growth_m)
        return Outcome::error;
      const Pose now = world.X_WO();
      if ((now * center - start * center).norm() >= most_m || turn_of(start, now) >= most_rad)
        return Outcome::lost;
    }
    return Outcome::held;
  };
  Outcome outcome = phase(Vec3::Zero(), protocol.settle_s, protocol.max_drift_m, protocol.max_drift_rad);
  if (outcome == Outcome::lost) return Outcome::unsettled;
  if (outcome != Outcome::held) return outcome;
  start = world.X_WO();
  return phase(body.mass_kg * protocol.acceleration_m_s2 * way, protocol.push_s, protocol.max_translation_m,
               protocol.max_rotation_rad);
}

struct Compared {
  std::string name;
  Outcome bullet = Outcome::held, mujoco = Outcome::held;
};

std::string words(const Seen& seen) {
  return fmt::format("{} at {:.2f} s, moved {:.1f} mm, turned {:.0f} deg, {:.2f} mm deep", name(seen.outcome),
                     seen.ended_s, 1e3 * seen.moved_m, seen.turned_rad / deg, 1e3 * seen.penetration_m);
}

void print(const char* tier, const std::vector<Compared>& trials) {
  std::size_t agree = 0;
  for (const Compared& trial : trials) agree += trial.bullet == trial.mujoco;
  std::printf("\n%s: %zu trials, the same outcome in %zu = %.1f %%\n\n| Bullet \\ MuJoCo |", tier,
              trials.size(), agree, trials.empty() ? 0 : 100.0 * agree / trials.size());
  for (const Outcome column : physics::outcomes) std::printf(" %s |", std::string(name(column)).c_str());
  std::printf("\n|---|---|---|---|---|---|\n");
  for (const Outcome row : physics::outcomes) {
    std::printf("| %s |", std::string(name(row)).c_str());
    for (const Outcome column : physics::outcomes)
      std::printf(" %td |", std::count_if(trials.begin(), trials.end(), [&](const Compared& trial) {
                    return trial.bullet == row && trial.mujoco == column;
                  }));
    std::printf("\n");
  }
  for (const Compared& trial : trials)
    if (trial.bullet != trial.mujoco)
      std::printf("- %s: Bullet %s, MuJoCo %s\n", trial.name.c_str(), std::string(name(trial.bullet)).c_str(),
                  std::string(name(trial.mujoco)).c_str());
}

void compare(const StudyObject& object, const hands::Hand& hand, const Settings& settings, bool cage,
             bool force, std::vector<Compared>& pulls, std::vector<Compared>& pushes) {
  const physics::Protocol& protocol = physics::find_protocol("geocage-force");
  const auto body = physics::solid_body(object.mesh, object.field, protocol.mass_kg);
  const double radius_m = physics::radius_about_m(object.mesh, body.X_OB.translation());
  const auto parts = physics::convex_parts(object.mesh, object.field, settings.parts);
  Eigen::AlignedBox3d box;
  for (const Vec3& p : object.mesh.vertices) box.extend(p);
  const auto shape = physics::voxel_shape(box, 1e-3, parts);
  std::printf("| %s | %zu | %ld, %d | %.1f |\n", object.name.c_str(), parts.size(), shape.euler, shape.pieces,
              100 * (shape.volume_m3 / geometry::mass_properties(object.mesh).volume_m3 - 1));
  std::fflush(stdout);
  std::size_t turn = 0;
  for (std::size_t g = 0; g < object.grasps.grasps.size(); ++g) {
    const auto& grasp = object.grasps.grasps[g];
    const auto q = hands::joint_vector(hand.tree, grasp.joints_rad, object.name);
    const std::string label = object.name + " grasp " + std::to_string(g) + " ";
    const auto locked = physics::lock({}, body, radius_m, hand, grasp.X_OH, q);
    MujocoWorld walls(settings.mujoco, body, parts, locked.escape.capsules());
    for (int i = 0; i < settings.ways; ++i) {
      const auto& way = physics::six_directions()[turn++ % 6];
      if (cage) {
        const Seen bullet = bullet_pull(locked, body, way.axis_O);
        const Seen mujoco = mujoco_pull(settings, locked, body, walls, way.axis_O);
        pulls.push_back({label + way.name, bullet.outcome, mujoco.outcome});
        if (bullet.outcome != mujoco.outcome)
          std::printf("- %s: Bullet %s; at an eighth of the step %s; MuJoCo %s\n", pulls.back().name.c_str(),
                      words(bullet).c_str(), words(bullet_pull(locked, body, way.axis_O, 8)).c_str(),
                      words(mujoco).c_str());
      }
      if (force) {
        const auto posture = physics::posture_at(hand, object.field, grasp.X_OH, q);
        pushes.push_back({label + way.name,
                          physics::push_trial(protocol, body, hand, posture, way, 0).outcome,
                          mujoco_push(settings, protocol, body, parts, hand, posture, way.axis_O)});
      }
    }
  }
}

/// Largest level that holds, bisected.
double largest(double low, double high, const std::function<bool(double)>& holds) {
  for (int i = 0; i < 9; ++i) (holds(0.5 * (low + high)) ? low : high) = 0.5 * (low + high);
  return 0.5 * (low + high);
}

physics::ConvexPart box_part(const Vec3& half) {
  physics::ConvexPart part;
  for (int corner = 0; corner < 8; ++corner)
    part.vertices_O.emplace_back((corner & 1 ? 1 : -1) * half.x(), (corner & 2 ? 1 : -1) * half.y(),
                                 (corner & 4 ? 1 : -1) * half.z());
  return part;
}

/// A cube between the pads of a gripper. One motor of F drives both jaws, so F dx = (N + N) dx and each
/// presses with F / 2: along the pads 2 mu F / 2 = mu F holds.
void pinched_cube(const Settings& settings) {
  const auto hand = hands::load_hand("parallel_2f");
  const Vec3 half = Vec3::Constant(0.0125);
  const auto field = physics::filled(Vec3::Constant(0.05), 0.001, [&](const Vec3& p) {
    const Vec3 q = p.cwiseAbs() - half;
    return q.cwiseMax(0).norm() + std::min(q.maxCoeff(), 0.0);
  });
  const double mass = 0.1;
  const physics::ObjectBody cube{&field, mass, Pose::Identity(),
                                 Vec3::Constant(mass / 3 * 2 * half.x() * half.x())};
  Pose X_OH = Pose::Identity();
  X_OH.translation().z() = -(0.112 + 0.01875);  // the middle of the pads
  Eigen::VectorXd q = Eigen::VectorXd::Constant(1, 0.0427 - half.x());
  const auto posture = physics::posture_at(hand, field, X_OH, q);
  physics::Protocol protocol = physics::find_protocol("geocage-force");
  const double limit = protocol.engine.friction * protocol.grip.force_limit_n / mass;
  for (const auto& [label, way] :
       {std::pair{"across the pads", Vec3(1, 0, 0)}, {"along the pads", Vec3(0, 0, 1)}}) {
    const auto holds = [&](bool bullet, double push) {
      physics::Protocol tested = protocol;
      tested.acceleration_m_s2 = push;
      const Outcome outcome = bullet
                                  ? physics::push_trial(tested, cube, hand, posture, {"", way}, 0).outcome
                                  : mujoco_push(settings, tested, cube, {box_part(half)}, hand, posture, way);
      return outcome == Outcome::held;
    };
    const double b = largest(0, 2 * limit, [&](double push) { return holds(true, push); });
    const double m = largest(0, 2 * limit, [&](double push) { return holds(false, push); });
    std::printf("| pinched cube, pushed %s: largest push, of mu F = %.0f N | 1 | %.3f | %.3f |\n", label,
                limit * mass, b / limit, m / limit);
  }
}

/// A block on two rails of the hand, tilted until it slips: arctan mu.
void incline(const Settings& settings) {
  const Vec3 half(0.05, 0.05, 0.01);
  const auto field = physics::filled(Vec3(0.09, 0.09, 0.05), 0.0025, [&](const Vec3& p) {
    const Vec3 q = p.cwiseAbs() - half;
    return q.cwiseMax(0).norm() + std::min(q.maxCoeff(), 0.0);
  });
  const Vec3 square = half.cwiseProduct(half);
  const double mass = 0.1, radius = 0.01;
  const physics::ObjectBody block{
      &field, mass, Pose::Identity(),
      mass / 3 * Vec3(square.y() + square.z(), square.x() + square.z(), square.x() + square.y())};
  hands::Hand rails;
  rails.name = "rails", rails.tree.links = {"base"};
  for (const double y : {-0.03, 0.03})
    rails.capsules.push_back({0, Vec3(-0.3, y, 0), Vec3(0.3, y, 0), radius});
  Pose X_OH = Pose::Identity();
  X_OH.translation().z() = -(radius + half.z());
  const auto slips = [&](bool bullet, double slope) {
    const Vec3 force = mass * 10 * Vec3(std::sin(slope), 0, -std::cos(slope));
    if (bullet) {
      physics::World world({}, block, rails, X_OH, Eigen::VectorXd(0), 0);
      for (int i = 0; i < 1000; ++i) world.step(force);
      return world.X_WB().translation().x() > 0.01;
    }
    MujocoWorld world(settings.mujoco, block, {box_part(half)}, rails, X_OH, Eigen::VectorXd(0));
    for (int i = 0; i < std::lround(1 / settings.mujoco.dt_s); ++i) world.step(force);
    return world.X_WO().translation().x() > 0.01;
  };
  double found[2];
  for (const bool bullet : {true, false})
    found[bullet] = largest(10 * deg, 50 * deg, [&](double slope) { return !slips(bullet, slope); }) / deg;
  std::printf("| block on rails: slips 1 cm in 1 s from, deg | %.2f | %.2f | %.2f |\n",
              std::atan(settings.mujoco.friction) / deg, found[1], found[0]);
}

/// A ring on a bar, pulled in the plane and along the bar. With end stops nothing gets it off; without them
/// the way along the bar is straight and free, which is an escape by rule, whichever way it is pulled
/// (escape_test.h).
void ring_on_bar(const Settings& settings) {
  const double R = 0.05, r = 0.008, bar_m = 0.006, mass = 0.1;
  const auto field = physics::filled(Vec3(0.09, 0.09, 0.04), 0.002, [&](const Vec3& p) {
    return std::hypot(std::hypot(p.x(), p.y()) - R, p.z()) - r;
  });
  const double along = mass * (R * R + 0.75 * r * r), across = mass * (0.5 * R * R + 0.625 * r * r);
  const physics::ObjectBody ring{&field, mass, Pose::Identity(), Vec3(across, across, along)};
  constexpr int around = 48, about = 16;
  std::vector<physics::ConvexPart> parts(
      around);  // slices of a torus through whose rim the facets' corners go
  const auto point = [&](double u, double v) {
    return Vec3((R + r * std::cos(v)) * std::cos(u), (R + r * std::cos(v)) * std::sin(u), r * std::sin(v));
  };
  for (int i = 0; i < around; ++i)
    for (int j = 0; j < about; ++j)
      for (const int end : {i, i + 1})
        parts[i].vertices_O.push_back(
            point(2 * std::numbers::pi * end / around, 2 * std::numbers::pi * j / about));
  for (const bool stops : {false, true}) {
    std::vector<hands::PlacedCapsule> bars = {{Vec3(0, 0, -0.06), Vec3(0, 0, 0.06), bar_m}};
    for (const double z : {-0.06, 0.06})
      for (int spoke = 0; stops && spoke < 6; ++spoke) {
        const double angle = spoke * std::numbers::pi / 3;
        bars.push_back({Vec3(0, 0, z), Vec3(0.12 * std::cos(angle), 0.12 * std::sin(angle), z), bar_m});
      }
    const physics::LockedHand locked{{}, {ring, R + r, bars}, Vec3::UnitZ(), 0};
    int held[3][2] = {};
    for (const auto& way : physics::six_directions()) {
      const bool axial = std::abs(way.axis_O.z()) > 0.5;
      held[0][axial] += stops;
      held[1][axial] +=
          physics::pull_trial(locked.protocol, ring, locked.escape, way.axis_O, 0).outcome == Outcome::held;
      MujocoWorld world(settings.mujoco, ring, parts, bars);
      held[2][axial] += mujoco_pull(settings, locked, ring, world, way.axis_O).outcome == Outcome::held;
    }
    std::printf("| ring on a bar %s end stops: held of 4 across, of 2 along | %d, %d | %d, %d | %d, %d |\n",
                stops ? "with" : "without", held[0][0], held[0][1], held[1][0], held[1][1], held[2][0],
                held[2][1]);
  }
}

}  // namespace
}  // namespace geocage::bench

int main(int argc, char** argv) {
  using namespace geocage::bench;
  StudyOptions options;
  options.seeds = 1;
  Settings settings;
  std::string tier = "all";
  if (argc < 2 || argc % 2 != 0) return std::fprintf(stderr, "mujoco_study FOLDER [options]\n"), 2;
  options.folder = argv[1];
  for (int i = 2; i + 1 < argc; i += 2) {
    const std::string key = argv[i], value = argv[i + 1];
    if (key == "--tier")
      tier = value;
    else if (key == "--part-mm")
      settings.parts = geocage::physics::parts_within(1e-3 * std::stod(value));
    else if (key == "--mujoco-dt")
      settings.mujoco.dt_s = std::stod(value), settings.mujoco.contact_s = 2 * settings.mujoco.dt_s;
    else if (key == "--ways")
      settings.ways = std::stoi(value);
    else if (key == "--impratio")
      settings.mujoco.impratio = std::stod(value);
    else if (!read_study_option(options, key, value))
      return std::fprintf(stderr, "unknown option %s\n", argv[i]), 2;
  }
  if (tier == "known" || tier == "all") {
    std::printf("| case | closed form | Bullet | MuJoCo |\n|---|---|---|---|\n");
    incline(settings);
    pinched_cube(settings);
    ring_on_bar(settings);
    std::fflush(stdout);
  }
  if (tier == "known") return 0;
  const auto hand = geocage::hands::load_hand(options.hand);
  const auto objects = study_grasps(options, hand);
  std::printf(
      "\n| object | convex parts | voxel Euler characteristic, pieces | volume %% |\n|---|---|---|---|\n");
  std::vector<Compared> pulls, pushes;
  for (const StudyObject& object : objects)
    compare(object, hand, settings, tier != "force", tier != "cage", pulls, pushes);
  if (tier != "force") print("cage tier, pulls", pulls);
  if (tier != "cage") print("force tier, pushes", pushes);
  return 0;
}
