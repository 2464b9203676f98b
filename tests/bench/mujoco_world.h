#pragma once
#include <memory>
#include <string>
#include <vector>

#include "physics/convex_parts.h"
#include "physics/protocols.h"
#include "physics/world.h"

#include "hands/hand.h"

struct mjModel_;
struct mjData_;

namespace geocage::bench {

/// How MuJoCo integrates, and how hard its contacts are: solref's time constant and solimp's width.
struct MujocoSettings {
  double dt_s = 0.001;  ///< at 2 ms grips creep and grazing pulls end otherwise
  double friction = 0.6;
  double contact_s = 0.002, width_m = 1e-4;
  double impratio = 100;  ///< how much stiffer friction is than the normal direction
  double hand_density_kg_m3 = 2000;
};

/// One object, as convex parts, and a hand or fixed capsules in MuJoCo (Todorov et al. 2012): elliptic cones,
/// Newton's method, gravity off. World axes are those of O at the start.
class MujocoWorld {
 public:
  /// Capsules that never move, without friction.
  MujocoWorld(const MujocoSettings& settings, const physics::ObjectBody& object,
              const std::vector<physics::ConvexPart>& parts,
              const std::vector<hands::PlacedCapsule>& walls_O);
  /// A hand with motors that ask for gain * error, at most the speed limit, with `grip`'s efforts.
  MujocoWorld(const MujocoSettings& settings, const physics::ObjectBody& object,
              const std::vector<physics::ConvexPart>& parts, const hands::Hand& hand,
              const geometry::Pose& X_OH, const Eigen::VectorXd& q);
  ~MujocoWorld();
  MujocoWorld(const MujocoWorld&) = delete;

  void hold(const hands::Hand& hand, const Eigen::VectorXd& q_target, const physics::Grip& grip);
  void step(const geometry::Vec3& force_W_n, const geometry::Vec3& torque_W_nm = geometry::Vec3::Zero());
  void damp(double share);  ///< of the object's velocity that is kept
  void reset();             ///< everything as it was at the start, motors off

  geometry::Pose X_WO() const;
  double speed_m_s() const;
  double spin_rad_s() const;
  double penetration_m() const;
  bool finite() const;
  const std::string& xml() const { return xml_; }

 private:
  void load(const physics::ObjectBody& object, const std::vector<physics::ConvexPart>& parts,
            const std::string& hand, const std::string& rest);

  MujocoSettings settings_;
  std::string xml_;
  geometry::Pose X_OB_;
  mjModel_* model_ = nullptr;
  mjData_* data_ = nullptr;
  int body_ = 0;
  std::vector<double> start_;  ///< joint positions
  struct Motor {
    int joint, actuator;
    double target, gain, most;
  };
  std::vector<Motor> motors_;
};

}  // namespace geocage::bench
