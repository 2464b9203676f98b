#include "tests/bench/mujoco_world.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <stdexcept>

#include <fmt/format.h>
#include <mujoco/mujoco.h>

namespace geocage::bench {
namespace {

using geometry::Pose;
using geometry::Vec3;
using physics::ConvexPart;

std::string text(const Vec3& p) {
  return fmt::format("{:.9g} {:.9g} {:.9g}", p.x(), p.y(), p.z());
}
std::string text(const Eigen::Matrix3d& R) {
  const Eigen::Quaterniond q(R);
  return fmt::format("{:.12g} {:.12g} {:.12g} {:.12g}", q.w(), q.x(), q.y(), q.z());
}
std::string at(const Pose& X) {
  return fmt::format("pos=\"{}\" quat=\"{}\"", text(Vec3(X.translation())),
                     text(Eigen::Matrix3d(X.linear())));
}

/// The hand's geoms meet the object's, not each other: its bits are 1 and 0, the object's 0 and 1.
std::string capsule(const Vec3& a, const Vec3& b, double radius, double density, double friction) {
  const std::string shape = (b - a).norm() < 1e-9
                                ? fmt::format("type=\"sphere\" pos=\"{}\"", text(a))
                                : fmt::format("type=\"capsule\" fromto=\"{} {}\"", text(a), text(b));
  return fmt::format(
      "<geom {} size=\"{:.9g}\" contype=\"1\" conaffinity=\"0\" density=\"{:.9g}\" "
      "friction=\"{:.9g} 0 0\"/>\n",
      shape, radius, density, friction);
}

std::string body_of(const hands::Hand& hand, int link, const MujocoSettings& settings) {
  std::string xml;
  bool bare = true;
  for (const hands::Capsule& part : hand.capsules)
    if (part.link == link) {
      xml += capsule(part.a_L, part.b_L, part.radius_m, settings.hand_density_kg_m3, settings.friction);
      bare = false;
    }
  if (bare) xml += "<inertial pos=\"0 0 0\" mass=\"0.01\" diaginertia=\"4e-7 4e-7 4e-7\"/>\n";
  for (const hands::Joint& joint : hand.tree.joints) {
    if (joint.parent_link != link) continue;
    xml += fmt::format("<body name=\"link{}\" {}>\n", joint.child_link, at(joint.X_PJ));
    if (joint.type != hands::Joint::Type::fixed)
      xml +=
          fmt::format("<joint name=\"{}\" type=\"{}\" axis=\"{}\" limited=\"{}\" range=\"{:.9g} {:.9g}\"/>\n",
                      joint.name, joint.type == hands::Joint::Type::prismatic ? "slide" : "hinge",
                      text(joint.axis_J), std::isfinite(joint.upper_rad) ? "true" : "false",
                      std::isfinite(joint.lower_rad) ? joint.lower_rad : 0.0,
                      std::isfinite(joint.upper_rad) ? joint.upper_rad : 0.0);
    xml += body_of(hand, joint.child_link, settings) + "</body>\n";
  }
  return xml;
}

bool leads(const hands::Hand& hand, const hands::Joint& joint) {
  return joint.type != hands::Joint::Type::fixed && joint.name == hand.tree.dof_names[joint.dof];
}

}  // namespace

void MujocoWorld::load(const physics::ObjectBody& object, const std::vector<ConvexPart>& parts,
                       const std::string& hand, const std::string& rest) {
  std::string meshes, geoms;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    meshes += fmt::format("<mesh name=\"part{}\" vertex=\"", i);
    for (const Vec3& p : parts[i].vertices_O) meshes += text(object.X_OB.inverse() * p) + " ";
    meshes += "\"/>\n";
    geoms += fmt::format(
        "<geom type=\"mesh\" mesh=\"part{}\" contype=\"0\" conaffinity=\"1\" "
        "friction=\"{:.9g} 0 0\" mass=\"1e-9\"/>\n",
        i, settings_.friction);
  }
  // MuJoCo takes the larger of two coefficients; both are the same here.
  xml_ = fmt::format(
      "<mujoco>\n<compiler angle=\"radian\" boundmass=\"1e-6\" boundinertia=\"1e-9\" "
      "balanceinertia=\"true\"/>\n"
      "<option timestep=\"{:.9g}\" gravity=\"0 0 0\" cone=\"elliptic\" impratio=\"{:.9g}\" "
      "integrator=\"implicit\" "
      "solver=\"Newton\" iterations=\"50\"/>\n<size nconmax=\"1000\" njmax=\"4000\"/>\n"
      "<default><geom condim=\"{}\" solref=\"{:.9g} 1\" solimp=\"0.95 0.99 {:.9g}\"/></default>\n"
      "<asset>\n{}</asset>\n<worldbody>\n{}"
      "<body name=\"object\" {}>\n<freejoint/>\n<inertial pos=\"0 0 0\" mass=\"{:.9g}\" "
      "diaginertia=\"{}\"/>\n{}</body>\n</worldbody>\n{}</mujoco>\n",
      settings_.dt_s, settings_.impratio, settings_.friction > 0 ? 3 : 1, settings_.contact_s,
      settings_.width_m, meshes, hand, at(object.X_OB), object.mass_kg, text(object.inertia_kg_m2), geoms,
      rest);
  X_OB_ = object.X_OB;
  const auto files = std::make_unique<mjVFS>();
  mj_defaultVFS(files.get());
  mj_makeEmptyFileVFS(files.get(), "world.xml", static_cast<int>(xml_.size()));
  std::memcpy(files->filedata[0], xml_.data(), xml_.size());
  char error[1000] = "";
  model_ = mj_loadXML("world.xml", files.get(), error, sizeof error);
  mj_deleteVFS(files.get());
  if (!model_) throw std::runtime_error(std::string("MuJoCo refuses the model: ") + error);
  data_ = mj_makeData(model_);
  body_ = mj_name2id(model_, mjOBJ_BODY, "object");
}

MujocoWorld::MujocoWorld(const MujocoSettings& settings, const physics::ObjectBody& object,
                         const std::vector<ConvexPart>& parts,
                         const std::vector<hands::PlacedCapsule>& walls_O)
    : settings_(settings) {
  settings_.friction = 0;
  std::string walls;
  for (const auto& wall : walls_O) walls += capsule(wall.a, wall.b, wall.radius_m, 1000, 0);
  load(object, parts, walls, "");
  start_.assign(data_->qpos, data_->qpos + model_->nq);
}

MujocoWorld::MujocoWorld(const MujocoSettings& settings, const physics::ObjectBody& object,
                         const std::vector<ConvexPart>& parts, const hands::Hand& hand, const Pose& X_OH,
                         const Eigen::VectorXd& q)
    : settings_(settings) {
  std::string actuators, couplings;
  for (const hands::Joint& joint : hand.tree.joints) {
    if (joint.type == hands::Joint::Type::fixed) continue;
    if (leads(hand, joint))
      actuators += fmt::format(
          "<general name=\"{0}\" joint=\"{0}\" biastype=\"affine\" gainprm=\"1\" "
          "biasprm=\"0 0 -1\" forcelimited=\"true\" forcerange=\"-1 1\"/>\n",
          joint.name);
    else
      couplings += fmt::format(
          "<joint joint1=\"{}\" joint2=\"{}\" polycoef=\"{:.9g} {:.9g} 0 0 0\" "
          "solref=\"0.004 1\"/>\n",
          joint.name, hand.tree.dof_names[joint.dof], joint.offset_rad, joint.multiplier);
  }
  load(object, parts,
       fmt::format("<body name=\"link0\" {}>\n{}</body>\n", at(X_OH), body_of(hand, 0, settings)),
       "<actuator>\n" + actuators + "</actuator>\n<equality>\n" + couplings + "</equality>\n");
  for (const hands::Joint& joint : hand.tree.joints) {
    if (joint.type == hands::Joint::Type::fixed) continue;
    const int id = mj_name2id(model_, mjOBJ_JOINT, joint.name.c_str());
    data_->qpos[model_->jnt_qposadr[id]] = joint.multiplier * q[joint.dof] + joint.offset_rad;
  }
  start_.assign(data_->qpos, data_->qpos + model_->nq);
}

void MujocoWorld::reset() {
  mj_resetData(model_, data_);
  std::ranges::copy(start_, data_->qpos);
  motors_.clear();
}

MujocoWorld::~MujocoWorld() {
  if (data_) mj_deleteData(data_);
  if (model_) mj_deleteModel(model_);
}

void MujocoWorld::hold(const hands::Hand& hand, const Eigen::VectorXd& q_target, const physics::Grip& grip) {
  motors_.clear();
  for (const hands::Joint& joint : hand.tree.joints) {
    if (!leads(hand, joint)) continue;
    const bool slides = joint.type == hands::Joint::Type::prismatic;
    const double own = hand.tree.effort_limit_nm[joint.dof];
    const double limit = slides ? grip.force_limit_n : grip.torque_limit_nm;
    const double effort = own > 0 ? std::min(own, limit) : limit;
    const double most = slides ? grip.speed_limit_m_s : grip.speed_limit_rad_s;
    const int actuator = mj_name2id(model_, mjOBJ_ACTUATOR, joint.name.c_str());
    // The whole effort at a tenth of the speed limit: a stiff motor that follows the asked speed.
    const double kv = effort / (0.1 * most);
    model_->actuator_gainprm[actuator * mjNGAIN] = kv;
    model_->actuator_biasprm[actuator * mjNBIAS + 2] = -kv;
    model_->actuator_forcerange[2 * actuator] = -effort,
                                    model_->actuator_forcerange[2 * actuator + 1] = effort;
    motors_.push_back({mj_name2id(model_, mjOBJ_JOINT, joint.name.c_str()), actuator, q_target[joint.dof],
                       grip.gain_1ps, most});
  }
}

void MujocoWorld::step(const Vec3& force_W_n, const Vec3& torque_W_nm) {
  for (const Motor& motor : motors_) {
    const double error = motor.target - data_->qpos[model_->jnt_qposadr[motor.joint]];
    data_->ctrl[motor.actuator] = std::clamp(motor.gain * error, -motor.most, motor.most);
  }
  mjtNum* applied = data_->xfrc_applied + 6 * body_;
  for (int i = 0; i < 3; ++i) applied[i] = force_W_n[i], applied[3 + i] = torque_W_nm[i];
  mj_step(model_, data_);
}

void MujocoWorld::damp(double share) {
  const int first = model_->body_dofadr[body_];
  for (int i = 0; i < 6; ++i) data_->qvel[first + i] *= share;
}

Pose MujocoWorld::X_WO() const {
  const int joint = model_->body_jntadr[body_];
  const mjtNum* q = data_->qpos + model_->jnt_qposadr[joint];
  Pose X_WB = Pose::Identity();
  X_WB.linear() = Eigen::Quaterniond(q[3], q[4], q[5], q[6]).normalized().toRotationMatrix();
  X_WB.translation() = Vec3(q[0], q[1], q[2]);
  return X_WB * X_OB_.inverse();
}

double MujocoWorld::speed_m_s() const {
  const mjtNum* v = data_->qvel + model_->body_dofadr[body_];
  return Vec3(v[0], v[1], v[2]).norm();
}

double MujocoWorld::spin_rad_s() const {
  const mjtNum* v = data_->qvel + model_->body_dofadr[body_] + 3;
  return Vec3(v[0], v[1], v[2]).norm();
}

double MujocoWorld::penetration_m() const {
  double deepest = 0;
  for (int i = 0; i < data_->ncon; ++i) deepest = std::max<double>(deepest, -data_->contact[i].dist);
  return deepest;
}

bool MujocoWorld::finite() const {
  return X_WO().matrix().allFinite() && std::isfinite(speed_m_s());
}

}  // namespace geocage::bench
