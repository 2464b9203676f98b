#include "hands/net.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace geocage::hands {

namespace {

constexpr double inward_share = 0.7;  // of the pull along the approach; the rest draws the net together

/// Vertices within `hops` edges of `vertex`, ascending.
std::vector<int> ball_of(const geometry::CompressedRows& neighbours, int vertex, int hops) {
  std::vector<int> front = {vertex}, ball = {vertex};
  std::vector<char> seen(neighbours.start.size() - 1, 0);
  seen[vertex] = 1;
  for (int hop = 0; hop < hops; ++hop) {
    std::vector<int> next;
    for (int v : front)
      for (int i = neighbours.start[v]; i < neighbours.start[v + 1]; ++i)
        if (!std::exchange(seen[neighbours.items[i]], 1)) next.push_back(neighbours.items[i]);
    ball.insert(ball.end(), next.begin(), next.end());
    front = std::move(next);
  }
  std::sort(ball.begin(), ball.end());
  return ball;
}

/// The net while it is drawn tight.
class Tightening {
 public:
  Tightening(const NetDescription& description, const geometry::SignedDistanceField& field, Net& net)
      : field_(field), net_(net), longest_(1 + description.stretch_share) {
    for (const auto& [a, b] : net.edges) rest_m_.push_back((net.points_O[a] - net.points_O[b]).norm());
  }

  void step(const Vec3& inward, double step_m) {
    Vec3 middle = Vec3::Zero();
    for (const Vec3& p : net_.points_O) middle += p / static_cast<double>(net_.points_O.size());
    for (Vec3& p : net_.points_O) {
      Vec3 together = middle - p;
      together -= together.dot(inward) * inward;
      const double far = together.norm();
      p += step_m * (inward_share * inward +
                     (far > step_m ? Vec3((1 - inward_share) / far * together) : Vec3::Zero()));
    }
    for (int sweep = 0; sweep < 10; ++sweep) {
      hold_edges();
      keep_off();
    }
  }

  double stretch() const {
    double most = 0;
    for (std::size_t e = 0; e < rest_m_.size(); ++e) most = std::max(most, length_m(e) / rest_m_[e] - 1);
    return most;
  }

 private:
  double length_m(std::size_t e) const {
    return (net_.points_O[net_.edges[e][0]] - net_.points_O[net_.edges[e][1]]).norm();
  }

  void hold_edges() {
    for (std::size_t e = 0; e < rest_m_.size(); ++e) {
      const double length = length_m(e), most = longest_ * rest_m_[e];
      if (length <= most) continue;
      Vec3 &a = net_.points_O[net_.edges[e][0]], &b = net_.points_O[net_.edges[e][1]];
      const Vec3 shift = 0.5 * (1 - most / length) * (b - a);
      a += shift;
      b -= shift;
    }
  }

  void keep_off() {
    for (Vec3& p : net_.points_O) {
      Vec3 gradient;
      const double inside = net_.point_radius_m - field_.value(p, gradient);
      if (inside > 0 && gradient.norm() > 1e-9) p += inside * gradient.normalized();
    }
  }

  const geometry::SignedDistanceField& field_;
  Net& net_;
  const double longest_;
  std::vector<double> rest_m_;
};

}  // namespace

Net tighten_net(const Hand& hand, const geometry::TriangleMesh& mesh,
                const geometry::SignedDistanceField& field, int vertex, double radius_m, const Vec3& inward_O,
                const TighteningRule& rule) {
  const auto neighbours = geometry::vertex_neighbours(mesh);
  const auto normals = geometry::vertex_normals(mesh);
  const auto ball = ball_of(neighbours, vertex, static_cast<int>(radius_m / geometry::mean_edge_m(mesh)));
  Net net;
  net.point_radius_m = hand.net->point_radius_m;
  std::vector<int> number(mesh.vertices.size(), -1);
  for (int v : ball) {
    number[v] = static_cast<int>(net.points_O.size());
    net.points_O.push_back(mesh.vertices[v] + hand.net->offset_m * normals[v]);
  }
  for (int v : ball)
    for (int i = neighbours.start[v]; i < neighbours.start[v + 1]; ++i)
      if (const int w = neighbours.items[i]; v < w && number[w] >= 0)
        net.edges.push_back({number[v], number[w]});
  Tightening tightening(*hand.net, field, net);
  for (int i = 0; i < rule.steps; ++i)
    tightening.step(inward_O, rule.step_m * (rule.steps - 1 - i) / rule.steps);
  net.stretch = tightening.stretch();
  for (std::size_t i = 0; i < net.points_O.size(); ++i) {
    Vec3 gradient;
    const Vec3& p = net.points_O[i];
    const double distance = field.value(p, gradient) - net.point_radius_m;
    net.penetration_m = std::max(net.penetration_m, -distance);
    if (distance > rule.contact_m || gradient.norm() < 1e-9) continue;
    const Vec3 n = gradient.normalized();
    net.contacts.push_back({static_cast<int>(i), p - (distance + net.point_radius_m) * n, n, distance});
  }
  return net;
}

std::vector<PlacedCapsule> net_capsules(const Net& net) {
  std::vector<PlacedCapsule> capsules;
  for (const auto& [a, b] : net.edges)
    capsules.push_back({net.points_O[a], net.points_O[b], net.point_radius_m});
  return capsules;
}

}  // namespace geocage::hands
