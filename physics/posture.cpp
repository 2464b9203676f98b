#include "physics/posture.h"

#include <algorithm>

#include <fmt/format.h>

#include "geometry/noise.h"
#include "hands/closing.h"
#include "pipeline/error.h"

namespace geocage::physics {
namespace {

using geometry::Pose;
using geometry::Vec3;
using pipeline::Fault;
using pipeline::UserError;

constexpr double far_m = 1;

std::string where(std::size_t grasp) {
  return fmt::format("grasp {}", grasp);
}

void check_pose(const Pose& X_OH, const std::string& element) {
  const Eigen::Matrix3d R = X_OH.linear();
  const double skew = (R.transpose() * R - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  if (X_OH.matrix().allFinite() && skew < 1e-6 && R.determinant() > 0) return;
  throw UserError(Fault::input, element + ": X_OH", "the pose is not a finite rigid motion",
                  "give p_m in metres and a unit quaternion q_wxyz");
}

}  // namespace

Posture posture_at(const hands::Hand& hand, const geometry::SignedDistanceField& field, const Pose& X_OH,
                   const Eigen::VectorXd& q) {
  Posture posture{X_OH, q, 0};
  for (const hands::PlacedCapsule& capsule : hands::placed_capsules(hand, X_OH, q))
    posture.penetration_m =
        std::max(posture.penetration_m, -hands::capsule_distance(field, capsule).distance_m);
  return posture;
}

std::vector<Posture> postures_of(const hands::GraspSet& set, const hands::Hand& hand,
                                 const geometry::SignedDistanceField& field) {
  std::vector<Posture> postures;
  for (std::size_t i = 0; i < set.grasps.size(); ++i) {
    const hands::Grasp& grasp = set.grasps[i];
    if (grasp.hand != hand.name)
      throw UserError(Fault::input, where(i),
                      fmt::format("is for the hand '{}', not '{}'", grasp.hand, hand.name),
                      "name the hand that the grasp was made for");
    check_pose(grasp.X_OH, where(i));
    postures.push_back(
        posture_at(hand, field, grasp.X_OH, hands::joint_vector(hand.tree, grasp.joints_rad, where(i))));
  }
  return postures;
}

Posture open_posture(const hands::Hand& hand, const geometry::SignedDistanceField& field,
                     const hands::Grasp& grasp) {
  const Eigen::VectorXd q =
      grasp.pregrasp_joints_rad.empty()
          ? hand.open_rad
          : hands::joint_vector(hand.tree, grasp.pregrasp_joints_rad, "pregrasp_joints_rad");
  return posture_at(hand, field, grasp.X_OH, q);
}

Posture far_posture(const hands::Hand& hand, const Posture& posture) {
  Posture away{posture.X_OH, posture.q, 0};
  away.X_OH.translate(-far_m * hand.approach_H);
  return away;
}

Posture random_posture(const hands::Hand& hand, const geometry::SignedDistanceField& field,
                       const Posture& posture, std::uint64_t seed, std::size_t index) {
  geometry::RandomStream random(seed, index);
  Eigen::VectorXd q = hand.open_rad;
  for (Eigen::Index i = 0; i < q.size(); ++i)
    q[i] = hand.tree.lower_rad[i] + random.uniform() * (hand.tree.upper_rad[i] - hand.tree.lower_rad[i]);
  return posture_at(hand, field, posture.X_OH, q);
}

void check_border(const geometry::TriangleMesh& object, const geometry::SignedDistanceField& field,
                  const hands::Hand& hand) {
  Eigen::AlignedBox3d surface;
  for (const Vec3& vertex : object.vertices) surface.extend(vertex);
  const Vec3 end =
      field.origin + field.cell_m * Vec3(field.nodes[0] - 1, field.nodes[1] - 1, field.nodes[2] - 1);
  const double border = std::min((surface.min() - field.origin).minCoeff(), (end - surface.max()).minCoeff());
  double thickest = 0;
  for (const hands::Capsule& capsule : hand.capsules) thickest = std::max(thickest, capsule.radius_m);
  if (border >= thickest) return;
  throw UserError(
      Fault::configuration, "field.pad_m",
      fmt::format("the field ends {:.1f} mm from the object, but '{}' has capsules of {:.1f} mm radius",
                  1e3 * border, hand.name, 1e3 * thickest),
      fmt::format("raise it to {:.3f} or more", thickest + 1e-3));
}

}  // namespace geocage::physics
