#include "cli/plan_scene.h"

#include <cmath>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "datasets/shapes.h"
#include "geometry/mesh_files.h"
#include "hands/toml_table.h"
#include "motion/tasks/limits.h"
#include "motion/tasks/self_clearance.h"
#include "motion/tasks/state.h"
#include "motion/tasks/winding.h"
#include "motion/tasks/writhe.h"
#include "pipeline/error.h"

namespace geocage::cli {

namespace fs = std::filesystem;
using Eigen::VectorXd;
using geometry::Pose;
using geometry::Vec3;
using hands::TomlTable;
using motion::Mover;
using pipeline::Fault;
using pipeline::UserError;

namespace {

double number_or(TomlTable& table, const std::string& key, double other) {
  return table.has(key) ? table.get<double>(key) : other;
}

int count_or(TomlTable& table, const std::string& key, int other, int most) {
  if (!table.has(key)) return other;
  const double value = table.get<double>(key);
  if (value != std::floor(value) || value < 1 || value > most)
    table.wrong(key, fmt::format("is not a whole number in [1, {}]", most));
  return static_cast<int>(value);
}

double positive_or(TomlTable& table, const std::string& key, double other) {
  return table.has(key) ? table.positive(key, 1e12) : other;
}

Eigen::Matrix3d turn_or_none(TomlTable& table, const std::string& key) {
  if (!table.has(key)) return Eigen::Matrix3d::Identity();
  const auto q = table.list<double>(key);
  if (q.size() != 4) table.wrong(key, "is not a quaternion: w, x, y, z");
  const Eigen::Quaterniond turn(q[0], q[1], q[2], q[3]);
  if (std::abs(turn.norm() - 1) > 1e-3) table.wrong(key, "is not of unit length");
  return turn.normalized().toRotationMatrix();
}

Pose pose_or_origin(TomlTable& table) {
  Pose X = Pose::Identity();
  if (table.has("p_m")) X.translation() = table.vector("p_m");
  X.linear() = turn_or_none(table, "q_wxyz");
  return X;
}

void read_robot(TomlTable table, PlanScene& scene) {
  scene.hand = hands::load_hand(table.get<std::string>("hand"));
  if (scene.hand.net) table.wrong("hand", "is a net of points, which does not move by joints");
  const Pose X = pose_or_origin(table);
  if (table.has("arm")) {
    scene.armed = std::make_unique<hands::ArmedHand>(
        hands::on_arm(hands::load_arm(table.get<std::string>("arm")), scene.hand));
    scene.mover = std::make_unique<Mover>(Mover::standing(scene.armed->body, X));
  } else {
    scene.mover = std::make_unique<Mover>(Mover::floating(scene.hand, X));
  }
  const hands::Hand& body = scene.mover->hand();
  VectorXd q = body.open_rad;
  if (table.has("joints_rad")) {
    TomlTable joints = table.table("joints_rad");
    for (const auto& name : joints.keys()) {
      const int dof = joints.index(name, name, [&](const std::string& n) { return body.tree.dof(n); });
      q[dof] = joints.get<double>(name);
      if (q[dof] < body.tree.lower_rad[dof] || q[dof] > body.tree.upper_rad[dof])
        joints.wrong(name, "is beyond the joint's limits");
    }
  }
  scene.start = scene.mover->state(X, q);
  scene.self_pairs = motion::self_pairs(body, q);
  table.end();
}

geometry::TriangleMesh placed(geometry::TriangleMesh mesh, const Pose& X) {
  for (Vec3& p : mesh.vertices) p = X * p;
  return mesh;
}

void read_obstacle(TomlTable table, const fs::path& folder, PlanScene& scene) {
  const auto shape = table.get<std::string>("shape");
  if (shape == "plane") {
    if (scene.obstacles.support) table.wrong("shape", "is the second plane; one is enough for a support");
    scene.obstacles.support = geometry::Plane{table.direction("normal"), table.get<double>("offset_m")};
    return table.end();
  }
  geometry::TriangleMesh mesh;
  if (shape == "sphere") {
    mesh = datasets::icosphere(table.length("radius_m"), 4);
  } else if (shape == "box") {
    const Vec3 size = table.vector("size_m");
    if (size.minCoeff() <= 0) table.wrong("size_m", "has a side that is not positive");
    mesh = datasets::box(size, 4);
  } else if (shape == "cylinder") {
    mesh = datasets::capped_cylinder(table.length("radius_m"), table.length("height_m"), 32);
  } else if (shape == "torus") {
    mesh = datasets::torus(table.length("ring_radius_m"), table.length("tube_radius_m"), 96, 32);
  } else if (shape == "mesh") {
    mesh = geometry::read_mesh(folder / table.get<std::string>("file"));
    geometry::orient_outward(mesh);
    if (const auto report = geometry::check_mesh(mesh); !report.closed_manifold())
      table.wrong("file", "is not a closed manifold: " + geometry::flaw(report));
  } else {
    table.wrong("shape", "is none of plane, sphere, box, cylinder, torus, mesh");
  }
  scene.fields.push_back(geometry::build_distance_field(placed(std::move(mesh), pose_or_origin(table)),
                                                        {.cells = 64, .pad_m = 0.05}));
  scene.obstacles.fields.push_back({&scene.fields.back()});
  table.end();
}

/// A task's table and what it is made of.
class TaskReader {
 public:
  TaskReader(TomlTable table, PlanScene& scene) : table_(std::move(table)), scene_(scene) {}

  void read() {
    const auto kind = table_.get<std::string>("kind");
    profile_ = precision();
    const auto& mover = *scene_.mover;
    auto& tasks = scene_.tasks;
    if (kind == "position") {
      tasks.push_back(motion::position_task(mover, frame(),
                                            motion::constant_target(table_.vector("target_m")), profile_));
    } else if (kind == "orientation") {
      auto R = turn_or_none(table_, "target_wxyz");
      tasks.push_back(motion::orientation_task(
          mover, frame(), [R](int) { return R; }, profile_));
    } else if (kind == "alignment") {
      const int link = frame().link;
      const Vec3 axis = table_.direction("axis"), along = table_.direction("along");
      tasks.push_back(motion::alignment_task(mover, link, axis, along, profile_));
    } else if (kind == "posture") {
      read_posture();
    } else if (kind == "limits") {
      tasks.push_back(motion::limits_task(mover.lower(), mover.upper(), profile_));
    } else if (kind == "clearance") {
      const std::vector<double> margin(profile_.size(), table_.length("margin_m"));
      tasks.push_back(motion::clearance_task(mover, scene_.obstacles, margin, profile_));
    } else if (kind == "self_collision") {
      tasks.push_back(
          motion::self_clearance_task(mover, scene_.self_pairs, table_.length("margin_m"), profile_));
    } else if (kind == "winding") {
      const auto target = goal();
      tasks.push_back(motion::winding_task(chain(), table_.vector("center_m"), table_.direction("normal"),
                                           target, profile_));
    } else if (kind == "writhe") {
      read_writhe();
    } else {
      table_.wrong("kind",
                   "is none of position, orientation, alignment, posture, limits, clearance, self_collision, "
                   "winding, writhe");
    }
    table_.end();
  }

 private:
  std::vector<double> precision() {
    const double rho = table_.positive("precision", 1e12);
    const std::string when = table_.has("when") ? table_.get<std::string>("when") : "always";
    if (when == "end") return motion::final_precision(scene_.horizon, rho);
    if (when != "always") table_.wrong("when", "is neither \"end\" nor \"always\"");
    return motion::constant_precision(scene_.horizon, rho);
  }

  /// A link, by the hand's base unless named, and a point of it.
  motion::LinkFrame frame() {
    motion::LinkFrame frame{scene_.armed ? scene_.armed->hand_link : 0};
    if (table_.has("link"))
      frame.link = table_.index("link", table_.get<std::string>("link"), [&](const std::string& name) {
        return scene_.mover->hand().tree.link(name);
      });
    if (table_.has("point_m")) frame.p_L = table_.vector("point_m");
    return frame;
  }

  /// The chain of a finger's links, or of the arm's.
  motion::MovingChain chain() {
    const auto name = table_.get<std::string>("chain");
    const auto& body = scene_.mover->hand();
    if (name == "arm" && scene_.armed) {
      std::vector<motion::LinkFrame> points;
      for (int link = 0; link <= scene_.armed->hand_link; ++link) points.push_back({link});
      return motion::chain_of(*scene_.mover, points);
    }
    std::vector<std::string> known;
    for (std::size_t f = 0; f < body.fingers.size(); ++f) {
      if (body.fingers[f].name == name)
        return motion::chain_of(*scene_.mover, motion::finger_points(body, f));
      known.push_back(body.fingers[f].name);
    }
    table_.wrong("chain", fmt::format("is none of the fingers {}{}", fmt::join(known, ", "),
                                      scene_.armed ? " nor \"arm\"" : ""));
  }

  motion::TargetOf goal() {
    return motion::constant_target(VectorXd::Constant(1, table_.get<double>("target")));
  }

  void read_posture() {
    const auto& tree = scene_.mover->hand().tree;
    TomlTable joints = table_.table("joints_rad");
    for (const auto& name : joints.keys()) {
      const int dof = joints.index(name, name, [&](const std::string& n) { return tree.dof(n); });
      scene_.tasks.push_back(motion::posture_task(VectorXd::Constant(1, joints.get<double>(name)),
                                                  scene_.mover->base_dofs() + dof, profile_));
      scene_.tasks.back().name = "posture of " + name;
    }
  }

  void read_writhe() {
    topology::Polyline rope;
    for (TomlTable point : table_.tables("rope")) {
      rope.push_back(point.vector("p_m"));
      point.end();
    }
    if (rope.size() < 2) table_.wrong("rope", "has fewer than two points");
    const auto target = goal();
    scene_.tasks.push_back(motion::writhe_task(chain(), rope, motion::WritheForm::scalar, target, profile_));
  }

  TomlTable table_;
  PlanScene& scene_;
  std::vector<double> profile_;
};

}  // namespace

void read_scene(const fs::path& file, PlanScene& scene) {
  if (!fs::is_regular_file(file))
    throw UserError(Fault::configuration, file.string(), "there is no such scene",
                    "docs/planning.md has an example");
  const toml::table parsed = hands::toml_of(file);
  TomlTable table(parsed, "docs/planning.md");
  scene.horizon = count_or(table, "horizon", scene.horizon, 1000);
  scene.step_variance = positive_or(table, "step_variance", scene.step_variance);
  scene.tolerance_m = number_or(table, "tolerance_m", scene.tolerance_m);
  scene.acceleration_rad_s2 = positive_or(table, "acceleration_rad_s2", scene.acceleration_rad_s2);
  if (table.has("search")) {
    const auto search = table.get<std::string>("search");
    if (search != "aico" && search != "gauss_newton")
      table.wrong("search", "is neither \"aico\" nor \"gauss_newton\"");
    scene.by_messages = search == "aico";
  }
  read_robot(table.table("robot"), scene);
  if (table.has("obstacle"))
    for (const TomlTable& obstacle : table.tables("obstacle"))
      read_obstacle(obstacle, file.parent_path(), scene);
  for (const TomlTable& task : table.tables("task")) TaskReader(task, scene).read();
  table.end();
}

}  // namespace geocage::cli
