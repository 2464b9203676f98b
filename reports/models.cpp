// Objects and hands as glTF.
#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>
#include <numbers>

#include "geometry/occupancy.h"
#include "reports/gltf.h"
#include "reports/scenes.h"
#include "reports/viewer_files.h"
#include "topology/balls.h"

namespace geocage::reports {

namespace fs = std::filesystem;
using geometry::Pose;
using geometry::Vec3;
using nlohmann::json;
using std::numbers::pi;

namespace {

constexpr std::size_t most_points = 6000, most_cells = 8000;
constexpr double margin_m = 0.1;  ///< cells that are farther from the object are not shown

std::vector<Vec3> thinned(const std::vector<Vec3>& points, std::size_t most) {
  const std::size_t stride = (points.size() + most - 1) / std::max<std::size_t>(most, 1);
  std::vector<Vec3> kept;
  for (std::size_t i = 0; i < points.size(); i += std::max<std::size_t>(stride, 1)) kept.push_back(points[i]);
  return kept;
}

std::vector<GltfField> fields_of(const topology::Scores& scores) {
  const auto& ball = scores.ball;
  std::vector<GltfField> fields;
  const auto add = [&](const char* name, const char* title, const char* unit, std::vector<double> values) {
    if (values.size() == scores.mesh.vertices.size())
      fields.push_back({name, title, unit, std::move(values)});
  };
  const auto numbers = [](const std::vector<int>& whole) {
    return std::vector<double>(whole.begin(), whole.end());
  };
  add("winding_angle_rad", "S1: winding angle", "rad", ball.winding_angle_rad);
  add("curvature_sum_rad", "S2: total curvature", "rad", ball.curvature_sum_rad);
  add("observed", "observed", "", scores.mesh.observed);
  add("angle_defect_rad", "curvature at the vertex", "rad", topology::angle_defects_rad(scores.mesh));
  add("ball_vertices", "vertices of the ball", "", numbers(ball.ball_vertices));
  add("euler", "Euler characteristic of the ball", "", numbers(ball.euler));
  return fields;
}

void add_cells(Gltf& file, int root, const fs::path& folder, const topology::Scores& scores) {
  geometry::Occupancy map;
  load_artefact(map, folder);
  const auto cells = geometry::occupied_cells(map);
  Eigen::AlignedBox3d box;
  for (const Vec3& p : scores.mesh.vertices) box.extend(p);
  box.min().array() -= margin_m, box.max().array() += margin_m;
  std::vector<Vec3> near;
  for (const Vec3& center : cells.centers_O)
    if (box.contains(center)) near.push_back(center);
  const std::size_t all = near.size();
  near = thinned(near, most_cells);
  if (near.empty()) return;
  const int node = file.add_node("occupancy", root, Pose::Identity(),
                                 {{"kind", "occupancy"}, {"side_m", cells.side_m}, {"cells", all}});
  file.add_points(node, near, Colour(0.9, 0.6, 0.2));
}

/// The capsules of a link in its own frame, coarser than a picture's: a hand has dozens of them.
geometry::TriangleMesh link_shape(const hands::Hand& hand, int link) {
  constexpr int around = 14, rings = 4;  // rings of a half ball
  geometry::TriangleMesh mesh;
  for (const hands::Capsule& capsule : hand.capsules) {
    if (capsule.link != link) continue;
    const int first = static_cast<int>(mesh.vertices.size());
    const Vec3 span = capsule.b_L - capsule.a_L;
    const Vec3 z = span.norm() > 0 ? span.normalized() : Vec3::UnitZ();
    const Vec3 x = z.unitOrthogonal(), y = z.cross(x);
    constexpr int rows = 2 * rings;  // the two equators are rows of their own
    mesh.vertices.push_back(capsule.a_L - capsule.radius_m * z);
    for (int i = 0; i < rows; ++i) {
      const bool lower = i < rings;
      const double latitude = pi / 2 * (lower ? i + 1 - rings : i - rings) / rings;
      for (int j = 0; j < around; ++j) {
        const double angle = 2 * pi * j / around;
        const Vec3 n =
            std::cos(latitude) * (std::cos(angle) * x + std::sin(angle) * y) + std::sin(latitude) * z;
        mesh.vertices.push_back((lower ? capsule.a_L : capsule.b_L) + capsule.radius_m * n);
      }
    }
    mesh.vertices.push_back(capsule.b_L + capsule.radius_m * z);
    const int top = static_cast<int>(mesh.vertices.size()) - 1;
    for (int j = 0; j < around; ++j) {
      const int k = (j + 1) % around;
      mesh.triangles.push_back({first, first + 1 + k, first + 1 + j});
      for (int i = 0; i + 1 < rows; ++i) {
        const int row = first + 1 + i * around;
        mesh.triangles.push_back({row + j, row + k, row + k + around});
        mesh.triangles.push_back({row + j, row + k + around, row + j + around});
      }
      mesh.triangles.push_back(
          {top, first + 1 + (rows - 1) * around + j, first + 1 + (rows - 1) * around + k});
    }
  }
  return mesh;
}

json joint_list(const hands::KinematicTree& tree) {
  json list = json::array();
  for (const hands::Joint& joint : tree.joints) {
    const Eigen::Quaterniond q(joint.X_PJ.linear());
    const Vec3 p = joint.X_PJ.translation();
    list.push_back({{"parent", joint.parent_link},
                    {"child", joint.child_link},
                    {"type", joint.type == hands::Joint::Type::fixed      ? "fixed"
                             : joint.type == hands::Joint::Type::revolute ? "revolute"
                                                                          : "prismatic"},
                    {"p", {p.x(), p.y(), p.z()}},
                    {"q_wxyz", {q.w(), q.x(), q.y(), q.z()}},
                    {"axis", {joint.axis_J.x(), joint.axis_J.y(), joint.axis_J.z()}},
                    {"dof", joint.dof},
                    {"multiplier", joint.multiplier},
                    {"offset", joint.offset_rad}});
  }
  return list;
}

std::vector<double> list_of(const Eigen::VectorXd& q) {
  return {q.data(), q.data() + q.size()};
}

/// `coloured`: with a colour a vertex for viewers that don't know the fields.
int add_object(Gltf& file, const topology::Scores& scores, bool coloured) {
  const double hop_m = scores.mesh.triangles.empty() ? 0 : geometry::mean_edge_m(scores.mesh);
  const int root = file.add_node("object", -1, Pose::Identity(),
                                 {{"kind", "object"}, {"radius_m", scores.ball.radius_m}, {"hop_m", hop_m}});
  const auto& winding = scores.ball.winding_angle_rad;
  std::vector<Colour> colours;
  if (coloured && winding.size() == scores.mesh.vertices.size()) {
    const Scale scale = sequential_scale(winding);
    for (const double value : winding) colours.push_back(scale.at(value));
  }
  if (!scores.mesh.vertices.empty())
    file.add_surface(root, scores.mesh, fields_of(scores), colours, Colour::Constant(0.6));
  return root;
}

void add_cloud(Gltf& file, int root, const geometry::PointCloud& cloud) {
  if (cloud.size() == 0) return;
  const int node =
      file.add_node("cloud", root, Pose::Identity(), {{"kind", "cloud"}, {"points", cloud.size()}});
  file.add_points(node, thinned(cloud.points, most_points), Colour(0.1, 0.3, 0.6));
}

std::vector<int> parents_of(const hands::KinematicTree& tree) {
  std::vector<int> parent(tree.links.size(), -1);
  for (const auto& joint : tree.joints) parent[joint.child_link] = joint.parent_link;
  return parent;
}

/// X_PL of every link in a posture.
std::vector<Pose> local_poses(const hands::KinematicTree& tree, const Eigen::VectorXd& q) {
  std::vector<Pose> X_HL, X_PL;
  hands::forward_kinematics(tree, q, X_HL);
  const auto parent = parents_of(tree);
  for (std::size_t i = 0; i < X_HL.size(); ++i)
    X_PL.push_back(parent[i] < 0 ? X_HL[i] : X_HL[parent[i]].inverse() * X_HL[i]);
  return X_PL;
}

/// The node of every link.
std::vector<int> add_hand(Gltf& file, const hands::Hand& hand, int base, const Eigen::VectorXd& q) {
  const auto& tree = hand.tree;
  const json extras = {{"kind", "hand"},
                       {"name", hand.name},
                       {"dofs", tree.dof_names},
                       {"lower", list_of(tree.lower_rad)},
                       {"upper", list_of(tree.upper_rad)},
                       {"open", list_of(hand.open_rad)},
                       {"joints", joint_list(tree)}};
  const auto X_PL = local_poses(tree, q);
  const auto parent = parents_of(tree);
  std::vector<int> nodes;
  for (std::size_t i = 0; i < tree.links.size(); ++i) {
    const int link = static_cast<int>(i);
    const bool finger = std::ranges::any_of(
        hand.fingers, [&](const hands::Finger& f) { return std::ranges::count(f.links, link) > 0; });
    json told = i == 0 ? extras : json::object();
    told["link"] = link;
    told["finger"] = finger;
    nodes.push_back(file.add_node(tree.links[i], parent[i] < 0 ? base : nodes[parent[i]], X_PL[i], told));
    const auto shape = link_shape(hand, link);
    if (!shape.vertices.empty())
      file.add_surface(nodes[i], shape, {}, {}, finger ? oklch(0.86, 0.012, 250) : oklch(0.42, 0.015, 250));
  }
  return nodes;
}

/// Every link's node through these postures, and `base`, unless it is -1, through `X_OH`.
void animate(Gltf& file, const hands::Hand& hand, const std::vector<int>& nodes, const std::string& name,
             const std::vector<double>& times_s, const std::vector<Eigen::VectorXd>& postures, int base,
             const std::vector<Pose>& X_OH) {
  std::vector<Gltf::Motion> motions;
  motions.reserve(nodes.size());
  for (const int node : nodes) motions.push_back({node, {}});
  for (const auto& q : postures) {
    const auto X_PL = local_poses(hand.tree, q);
    for (std::size_t i = 0; i < nodes.size(); ++i) motions[i].X_PN.push_back(X_PL[i]);
  }
  if (base >= 0) motions.push_back({base, X_OH});
  file.add_animation(name, times_s, motions);
}

void add_way(Gltf& file, const hands::Hand& hand, const std::vector<int>& nodes, int base,
             const fs::path& folder) {
  const fs::path path = folder / "trajectory_0.json";
  std::ifstream in(path);
  if (folder.empty() || !in) return;
  const json way = json::parse(in);
  std::vector<double> times_s;
  std::vector<Eigen::VectorXd> postures;
  std::vector<Pose> X_OH;
  for (std::size_t i = 0; i < way.at("q_rad").size(); ++i) {
    std::map<std::string, double> joints;
    for (std::size_t k = 0; k < way.at("joints").size(); ++k)
      joints[way["joints"][k]] = way["q_rad"][i].at(k);
    times_s.push_back(static_cast<double>(i) * way.at("dt_s").get<double>());
    postures.push_back(hands::joint_vector(hand.tree, joints, path.string()));
    X_OH.push_back(hands::pose_from_json(way.at("X_OH").at(i), path.string()));
  }
  animate(file, hand, nodes, "approach", times_s, postures, base, X_OH);
}

}  // namespace

std::vector<std::uint8_t> object_glb(const topology::Scores& scores, const geometry::PointCloud* cloud,
                                     const fs::path& occupancy) {
  Gltf file;
  const int root = add_object(file, scores, false);
  if (cloud) add_cloud(file, root, *cloud);
  if (!occupancy.empty()) add_cells(file, root, occupancy, scores);
  return file.glb();
}

std::vector<std::uint8_t> hand_glb(const hands::Hand& hand) {
  Gltf file;
  add_hand(file, hand, -1, hand.open_rad);
  return file.glb();
}

std::vector<std::uint8_t> pair_glb(const PairResults& pair, const std::vector<hands::Hand>& hands) {
  Gltf file;
  const int root = pair.scores ? add_object(file, *pair.scores, true) : -1;
  if (pair.cloud) add_cloud(file, root, *pair.cloud);
  const auto hand = std::ranges::find(hands, pair.input.hand, &hands::Hand::name);
  if (hand == hands.end() || !pair.grasps || pair.grasps->grasps.empty()) return file.glb();
  const hands::Grasp& grasp = pair.grasps->grasps.front();
  if (grasp.joints_rad.empty()) return file.glb();
  const std::string where = pair.input.grasps.string();
  const auto closed = hands::joint_vector(hand->tree, grasp.joints_rad, where);
  const int base = file.add_node("grasp", -1, grasp.X_OH);
  const auto nodes = add_hand(file, *hand, base, closed);
  if (!grasp.pregrasp_joints_rad.empty()) {
    const auto open = hands::joint_vector(hand->tree, grasp.pregrasp_joints_rad, where);
    animate(file, *hand, nodes, "close", {0, 1}, {open, closed}, -1, {});
  }
  add_way(file, *hand, nodes, base, pair.input.trajectories);
  return file.glb();
}

}  // namespace geocage::reports
