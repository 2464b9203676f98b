#pragma once
#include <functional>

#include "physics/outcome.h"
#include "physics/protocols.h"
#include "physics/recording.h"
#include "physics/world.h"

namespace geocage::physics {

/// Force and torque on the object, about its centre of mass.
struct ObjectLoad {
  geometry::Vec3 force_W_n = geometry::Vec3::Zero(), torque_W_nm = geometry::Vec3::Zero();
};

/// Where a trial writes its frames, if anywhere.
struct Camera {
  Recording* recording = nullptr;
  geometry::Pose X_BO = geometry::Pose::Identity(), X_WH = geometry::Pose::Identity();
  double start_s = 0;  ///< of the present phase
  /// Where the frame that is simulated as W stands in the recording's W, at a time of the phase.
  std::function<geometry::Pose(double)> moving = nullptr;

  void see(const World& world, const char* phase, double time_s, bool last = false) const;
};

/// A stretch of simulated time: ends when the object has moved too far or rests, or the engine has failed.
struct Phase {
  enum class End { elapsed, rest, moved, failed } end = End::elapsed;
  double translation_m = 0, rotation_rad = 0;  ///< largest motion from where the object was
  double penetration_m = 0;
  int steps = 0;
};

struct PhaseLimits {
  double translation_m, rotation_rad, penetration_m;
  bool ends_at_rest = true;
};

/// `load` at each time of the phase, before that step. Motion is against the phase's start, or `from`.
Phase simulate(World& world, const Protocol& protocol, const std::function<ObjectLoad(double)>& load,
               double duration_s, const PhaseLimits& limits, Camera& camera, const char* name,
               const geometry::Pose* from = nullptr);

/// `when_moved`, error, or held.
Outcome outcome_of(Phase::End end, Outcome when_moved);

}  // namespace geocage::physics
