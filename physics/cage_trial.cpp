#include "physics/cage_trial.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>

#include "geometry/noise.h"

namespace geocage::physics {
namespace {

using geometry::Pose;
using geometry::Vec3;

struct Load {
  Vec3 force_W_n = Vec3::Zero(), torque_W_nm = Vec3::Zero();
};

/// How often an escape is looked for.
constexpr double look_s = 0.05;

int steps_of(double duration_s, double dt_s) {
  return static_cast<int>(std::lround(duration_s / dt_s));
}

/// Runs one trial. `X_EW` takes the frame W of the world to the one of `escape`.
struct Trial {
  const CageProtocol& protocol;
  const EscapeTest& escape;
  CageWorld world;
  Pose X_BO, X_EW;
  CageTrial seen;
  std::optional<Vec3> locked_E;
  int ticks = 0, resting = 0;
  Recording* recording = nullptr;
  const char* phase = "pull";

  Trial(const CageProtocol& protocol_in, const CageEngine& engine, const ObjectBody& object,
        const EscapeTest& escape_in, const Eigen::Matrix3d& R_WE, std::uint64_t seed)
      : protocol(protocol_in),
        escape(escape_in),
        world(engine, object, escape_in.object_ball().radius_m, turned(escape_in.capsules(), R_WE),
              turn(R_WE), seed),
        X_BO(object.X_OB.inverse()),
        X_EW(turn(R_WE).inverse()) {}

  static Pose turn(const Eigen::Matrix3d& R) {
    Pose X = Pose::Identity();
    X.linear() = R;
    return X;
  }
  static std::vector<hands::PlacedCapsule> turned(std::vector<hands::PlacedCapsule> capsules,
                                                  const Eigen::Matrix3d& R) {
    for (hands::PlacedCapsule& capsule : capsules) capsule.a = R * capsule.a, capsule.b = R * capsule.b;
    return capsules;
  }

  Pose X_EO() const { return X_EW * world.X_WB() * X_BO; }

  bool escaped() const {
    const Pose X = X_EO();
    return escape.gone(X) || (escape.beside(X) && escape.straight_way_out(X, locked_E));
  }

  void show(bool last = false) {
    if (!recording || recording->frames.empty()) return;
    const Frame first = recording->frames.front();  // the hand is locked
    recording->see(ticks * protocol.engine.dt_s, phase, X_EO(), first.X_WH, first.q, last);
  }

  /// True when the trial is over.
  bool step(const Load& load, const Pose& start) {
    seen.steps += world.step(load.force_W_n, load.torque_W_nm);
    ++ticks;
    const double speed = world.velocity_m_s().norm(), spin = world.spin_rad_s().norm();
    seen.penetration_m = std::max(seen.penetration_m, world.penetration_m());
    const bool sane = speed <= protocol.max_speed_m_s && std::isfinite(spin);  // false for NaN, too
    if (!sane || seen.penetration_m > protocol.max_penetration_m) return seen.outcome = Outcome::error, true;
    const Pose now = world.X_WB();
    seen.max_displacement_m =
        std::max(seen.max_displacement_m, (now.translation() - start.translation()).norm());
    seen.max_rotation_rad =
        std::max(seen.max_rotation_rad, Eigen::AngleAxisd(start.linear().transpose() * now.linear()).angle());
    const bool rests = speed < protocol.rest_speed_m_s && spin < protocol.rest_spin_rad_s;
    resting = rests ? resting + 1 : 0;
    return false;
  }

  void run(const std::function<Load(int)>& load, double duration_s, bool stop_at_rest) {
    const double dt = protocol.engine.dt_s;
    const int steps = steps_of(duration_s, dt), look = std::max(1, steps_of(look_s, dt));
    const int rest = steps_of(protocol.rest_s, dt);
    const Pose start = world.X_WB();
    while (ticks < steps) {
      if (step(load(ticks), start)) break;
      show();
      if (ticks % look == 0 && escaped()) {
        seen.outcome = Outcome::lost;
        break;
      }
      if (stop_at_rest && resting >= rest) break;
    }
    show(true);
    seen.ended_s = ticks * dt;
  }
};

}  // namespace

CageTrial pull_trial(const CageProtocol& protocol, const ObjectBody& object, const EscapeTest& escape,
                     const Vec3& axis_O, std::uint64_t seed, Recording* recording) {
  Trial trial(protocol, protocol.engine, object, escape, Eigen::Matrix3d::Identity(), seed);
  trial.recording = recording;
  Load load{object.mass_kg * protocol.gravity_m_s2 * axis_O, Vec3::Zero()};
  trial.run([&](int) { return load; }, protocol.pull_s, true);
  return trial.seen;
}

CageTrial ring_trial(const CageProtocol& protocol, const ObjectBody& object, const EscapeTest& escape,
                     const Vec3& ring_O, double angle_rad, std::uint64_t seed, Recording* recording) {
  CageEngine engine = protocol.engine;
  engine.axis_locked = true;
  Trial trial(protocol, engine, object, escape, geometry::frame_from_z(ring_O).transpose(), seed);
  const Vec3 along(std::cos(angle_rad), std::sin(angle_rad), 0);
  Load load{object.mass_kg * protocol.gravity_m_s2 * along, Vec3::Zero()};
  trial.locked_E = ring_O, trial.recording = recording, trial.phase = "ring";
  trial.run([&](int) { return load; }, protocol.pull_s, true);
  return trial.seen;
}

CageTrial wrench_trial(const CageProtocol& protocol, const ObjectBody& object, const EscapeTest& escape,
                       double amplitude, std::uint64_t seed, Recording* recording) {
  Trial trial(protocol, protocol.engine, object, escape, Eigen::Matrix3d::Identity(), seed);
  trial.recording = recording, trial.phase = "wrench";
  geometry::RandomStream random(seed, 0);
  const double newtons = amplitude * object.mass_kg * protocol.gravity_m_s2;
  const int hold = steps_of(protocol.wrench_hold_s, protocol.engine.dt_s);
  Load load;
  const auto next = [&](int step) {
    if (step % hold == 0) {
      const double push = newtons * random.normal();
      load.force_W_n = push * random.direction();
      const double twist = newtons * gyration_m(object) * random.normal();
      load.torque_W_nm = twist * random.direction();
    }
    return load;
  };
  trial.run(next, protocol.wrench_s, false);
  if (trial.seen.outcome == Outcome::held && escape.straight_way_out(trial.X_EO()))
    trial.seen.outcome = Outcome::lost;
  return trial.seen;
}

}  // namespace geocage::physics
