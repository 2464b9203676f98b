#include "hands/closing.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace geocage::hands {

namespace {

constexpr double inf = std::numeric_limits<double>::infinity();
constexpr double touch_m = 0.0002;         // what counts as touching while the hand closes
constexpr double axis_precision_m = 2e-5;  // of the nearest point along a capsule's axis

/// Where f is smallest in [low, high], by golden section (Kiefer 1953); the best of all that was looked at.
template <class Function>
std::pair<double, double> golden_section(const Function& f, double low, double high, double precision) {
  constexpr double ratio = 0.6180339887498949;
  double left = high - ratio * (high - low), right = low + ratio * (high - low);
  double f_left = f(left), f_right = f(right);
  while (high - low > precision) {
    if (f_left < f_right) {
      high = right;
      right = left;
      f_right = f_left;
      f_left = f(left = high - ratio * (high - low));
    } else {
      low = left;
      left = right;
      f_left = f_right;
      f_right = f(right = low + ratio * (high - low));
    }
  }
  return f_left < f_right ? std::pair{left, f_left} : std::pair{right, f_right};
}

/// Joints that close at once, in one proportion, until something stops them.
struct Group {
  std::vector<int> dofs;
  std::vector<int> moved;               ///< capsules that a joint of the group moves
  std::vector<std::vector<int>> meets;  ///< of each of them: capsules that it may run into
};

/// A hand on its way from open to closed. Remembers how far each capsule is known to be free, and looks again
/// only when the way since then has used that up.
class Closing {
 public:
  Closing(const Hand& hand, const geometry::SignedDistanceField& field, const Pose& X_OH,
          const Eigen::VectorXd& q, const ClosingRule& rule, std::vector<Eigen::VectorXd>* path)
      : hand_(hand), field_(field), rule_(rule), X_OH_(X_OH), q_(q), path_(path) {
    place();
    const std::size_t n = capsules_.size();
    apart_.assign(n * n, 0);
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t j = 0; j < i; ++j)
        apart_[i * n + j] = apart_[j * n + i] =
            !jointed(i, j) && capsule_gap_m(capsules_[i], capsules_[j]) > touch_m;
    if (path_) path_->push_back(q_);
  }

  const Eigen::VectorXd& q() const { return q_; }
  const std::vector<PlacedCapsule>& capsules() const { return capsules_; }

  /// Closes the groups side by side, a step each in turn.
  void close(std::vector<Group> groups) {
    free_of_object_m_.assign(capsules_.size(), -inf);
    free_of_hand_m_.assign(capsules_.size(), -inf);
    for (Group& group : groups) find_moved(group);
    while (!groups.empty()) std::erase_if(groups, [&](Group& group) { return !step(group); });
  }

 private:
  void place() {
    forward_kinematics(hand_.tree, q_, X_HL_);
    place_capsules(hand_, X_OH_, X_HL_, capsules_);
  }

  /// Calls f(joint) for each joint of `dof` between the base and the link.
  template <class Function>
  void for_joints(int dof, int link, Function f) const {
    for (; link != 0; link = hand_.tree.joints[link - 1].parent_link) {
      const Joint& joint = hand_.tree.joints[link - 1];
      if (joint.type != Joint::Type::fixed && joint.dof == dof) f(joint);
    }
  }

  /// Neighbours share a joint, where they overlap.
  bool jointed(std::size_t i, std::size_t j) const {
    const int a = hand_.capsules[i].link, b = hand_.capsules[j].link;
    const auto parent = [&](int link) { return link == 0 ? -1 : hand_.tree.joints[link - 1].parent_link; };
    return a == b || parent(a) == b || parent(b) == a;
  }

  /// How far any point of a capsule moves per radian of `dof`, at most; 0 when `dof` does not move it.
  double lever_m(int dof, int i) const {
    double lever = 0;
    for_joints(dof, hand_.capsules[i].link, [&](const Joint& joint) {
      const Pose X_OL = X_OH_ * X_HL_[joint.child_link];
      const Vec3 axis_O = X_OL.linear() * joint.axis_J, p_O = X_OL.translation();
      const double a = axis_O.cross(capsules_[i].a - p_O).norm(),
                   b = axis_O.cross(capsules_[i].b - p_O).norm();
      const double reach = joint.type == Joint::Type::prismatic ? 1 : std::max(a, b) + capsules_[i].radius_m;
      lever += std::abs(joint.multiplier) * reach;
    });
    return lever;
  }

  /// Whether `dof` moves two capsules as one: through the same joints.
  bool moves_as_one(int dof, int i, int j) const {
    std::vector<const Joint*> of_i, of_j;
    for_joints(dof, hand_.capsules[i].link, [&](const Joint& joint) { of_i.push_back(&joint); });
    for_joints(dof, hand_.capsules[j].link, [&](const Joint& joint) { of_j.push_back(&joint); });
    return of_i == of_j;
  }

  void find_moved(Group& group) const {
    group.moved.clear();
    group.meets.clear();
    const int n = static_cast<int>(capsules_.size());
    for (int i = 0; i < n; ++i) {
      const auto moves = [&](int dof) { return lever_m(dof, i) > 0; };
      if (std::none_of(group.dofs.begin(), group.dofs.end(), moves)) continue;
      group.moved.push_back(i);
      std::vector<int> meets;
      for (int j = 0; j < n; ++j)
        if (apart_[i * n + j] && std::any_of(group.dofs.begin(), group.dofs.end(),
                                             [&](int dof) { return !moves_as_one(dof, i, j); }))
          meets.push_back(j);
      group.meets.push_back(std::move(meets));
    }
  }

  /// One step; false when all joints of the group stay for good.
  bool step(Group& group) {
    double t = rule_.step_rad;
    const auto ended = [&](int dof) {
      const double room = room_rad(dof) / speed(dof);
      if (room > 0) t = std::min(t, room);
      return room <= 0;
    };
    if (std::erase_if(group.dofs, ended) > 0) find_moved(group);
    if (group.dofs.empty()) return false;
    // Turning about several axes at once, distal levers carry proximal ones along: at most by this factor.
    double speeds = 0;
    for (int dof : group.dofs) speeds += speed(dof);
    const double growth = group.dofs.size() > 1 ? 1 + speeds * t : 1;
    std::vector<double>& lever = levers_;
    lever.assign(group.moved.size(), 0);
    for (std::size_t k = 0; k < group.moved.size(); ++k) {
      for (int dof : group.dofs) lever[k] += growth * speed(dof) * lever_m(dof, group.moved[k]);
      const double free_m = free_distance_m(group.moved[k], group.meets[k], t * lever[k]);
      if (free_m <= touch_m) return stop(group, group.moved[k]);
      t = std::min(t, free_m / lever[k]);
    }
    turn(group, t);
    return true;
  }

  /// The joints that move a capsule which touches stay; the others go on.
  bool stop(Group& group, int touching) {
    std::erase_if(group.dofs, [&](int dof) { return lever_m(dof, touching) > 0; });
    if (!group.dofs.empty()) find_moved(group);
    return !group.dofs.empty();
  }

  void turn(const Group& group, double t) {
    double most = 0;
    for (std::size_t k = 0; k < group.moved.size(); ++k) {
      const double way_m = t * levers_[k];
      most = std::max(most, way_m);
      free_of_object_m_[group.moved[k]] -= way_m;
    }
    for (double& free_m : free_of_hand_m_) free_m -= 2 * most;  // itself and what it may meet
    for (int dof : group.dofs) q_[dof] += hand_.closing_rad[dof] * std::min(t * speed(dof), room_rad(dof));
    place();
    if (path_) path_->push_back(q_);
  }

  double room_rad(int dof) const {
    const double way = hand_.closing_rad[dof];
    return way * ((way > 0 ? hand_.tree.upper_rad[dof] : hand_.tree.lower_rad[dof]) - q_[dof]);
  }
  double speed(int dof) const { return hand_.closing_speed[dof]; }

  /// How far the capsule may move before it touches object or hand; what is farther than `enough_m` need not
  /// be exact.
  double free_distance_m(int i, const std::vector<int>& meets, double enough_m) {
    const PlacedCapsule& capsule = capsules_[i];
    double& of_object = free_of_object_m_[i];
    if (of_object < enough_m + touch_m) {
      of_object = capsule_distance_bound_m(field_, capsule);
      if (of_object < enough_m + touch_m) of_object = capsule_distance(field_, capsule).distance_m;
    }
    double& of_hand = free_of_hand_m_[i];
    if (of_hand < enough_m + touch_m) {
      of_hand = inf;
      for (int j : meets) of_hand = std::min(of_hand, capsule_gap_m(capsule, capsules_[j]));
    }
    return std::min(of_object, of_hand);
  }

  const Hand& hand_;
  const geometry::SignedDistanceField& field_;
  const ClosingRule& rule_;
  const Pose X_OH_;
  Eigen::VectorXd q_;
  std::vector<Eigen::VectorXd>* path_;
  std::vector<Pose> X_HL_;
  std::vector<PlacedCapsule> capsules_;
  std::vector<char> apart_;  ///< pairs that are neither neighbours nor in touch from the start
  std::vector<double> free_of_object_m_, free_of_hand_m_, levers_;
};

/// What closes side by side, one list after the other. Fingers may share a joint.
std::vector<std::vector<Group>> groups_of(const Hand& hand, ClosingOrder order) {
  std::vector<std::vector<Group>> ranks;
  std::vector<char> taken(static_cast<std::size_t>(hand.tree.dofs()), 0);
  for (const Finger& finger : hand.fingers) {
    std::size_t group = 0, rank = 0;
    for (std::size_t i = 0; i < finger.dofs.size(); ++i) {
      if (std::exchange(taken[finger.dofs[i]], 1)) continue;
      if (order == ClosingOrder::proximal_first) rank = i;
      ranks.resize(std::max(ranks.size(), rank + 1));
      if (order != ClosingOrder::breakaway || group == 0) {
        ranks[rank].emplace_back();
        group = ranks[rank].size();
      }
      ranks[rank][group - 1].dofs.push_back(finger.dofs[i]);
    }
  }
  return ranks;
}

std::vector<CapsuleDistance> distances(const geometry::SignedDistanceField& field,
                                       const std::vector<PlacedCapsule>& capsules) {
  std::vector<CapsuleDistance> all;
  all.reserve(capsules.size());
  for (const PlacedCapsule& capsule : capsules) all.push_back(capsule_distance(field, capsule));
  return all;
}

double deepest_m(const std::vector<CapsuleDistance>& all) {
  double deepest = 0;
  for (const CapsuleDistance& at : all) deepest = std::max(deepest, -at.distance_m);
  return deepest;
}

std::vector<Contact> nearest_of_links(const Hand& hand, const std::vector<CapsuleDistance>& all,
                                      double contact_m) {
  std::vector<Contact> nearest(hand.tree.links.size(), Contact{.distance_m = inf});
  for (std::size_t i = 0; i < hand.capsules.size(); ++i) {
    const CapsuleDistance& at = all[i];
    Contact& contact = nearest[hand.capsules[i].link];
    if (at.distance_m >= contact.distance_m) continue;
    contact = {hand.capsules[i].link, at.p_O - (at.distance_m + hand.capsules[i].radius_m) * at.n_O, at.n_O,
               at.distance_m};
  }
  std::erase_if(nearest, [&](const Contact& contact) { return contact.distance_m > contact_m; });
  return nearest;
}

int fingers_of(const Hand& hand, const std::vector<Contact>& contacts) {
  return static_cast<int>(std::count_if(hand.fingers.begin(), hand.fingers.end(), [&](const Finger& finger) {
    return std::any_of(contacts.begin(), contacts.end(), [&](const Contact& contact) {
      return std::find(finger.links.begin(), finger.links.end(), contact.link) != finger.links.end();
    });
  }));
}

}  // namespace

CapsuleDistance capsule_distance(const geometry::SignedDistanceField& field, const PlacedCapsule& capsule_O,
                                 double step_m) {
  const Vec3 axis = capsule_O.b - capsule_O.a;
  const double length = axis.norm();
  const auto point = [&](double t) -> Vec3 {
    return length > 0 ? capsule_O.a + t / length * axis : capsule_O.a;
  };
  const auto value = [&](double t) { return field.value(point(t)); };
  double at = length, smallest = value(length);
  for (double t = 0; t < length;) {
    const double here = value(t);
    if (here < smallest) at = t, smallest = here;
    t += std::max(step_m, here - smallest);  // a distance falls by at most what one walks
  }
  if (length > 0) {
    const auto [t, refined] =
        golden_section(value, std::max(0.0, at - step_m), std::min(length, at + step_m), axis_precision_m);
    if (refined < smallest) at = t, smallest = refined;
  }
  CapsuleDistance nearest{smallest - capsule_O.radius_m, point(at), Vec3::UnitZ()};
  Vec3 gradient;
  field.value(nearest.p_O, gradient);
  if (gradient.norm() > 1e-9) nearest.n_O = gradient.normalized();
  return nearest;
}

double capsule_distance_bound_m(const geometry::SignedDistanceField& field, const PlacedCapsule& capsule_O) {
  const Vec3 middle = 0.5 * (capsule_O.a + capsule_O.b);
  return field.value(middle) - 0.5 * (capsule_O.b - capsule_O.a).norm() - capsule_O.radius_m;
}

// Closest points of two segments: Ericson, Real-Time Collision Detection (2005), 5.1.9.
double capsule_gap_m(const PlacedCapsule& first, const PlacedCapsule& second) {
  constexpr double tiny = 1e-18;  // squared metres: a segment that is a point
  const Vec3 d1 = first.b - first.a, d2 = second.b - second.a, r = first.a - second.a;
  const double a = d1.squaredNorm(), e = d2.squaredNorm(), f = d2.dot(r), c = d1.dot(r), b = d1.dot(d2);
  const auto clamped = [](double x) { return std::clamp(x, 0.0, 1.0); };
  double s = 0, t = 0;
  if (a <= tiny) {
    t = e <= tiny ? 0 : clamped(f / e);
  } else if (e <= tiny) {
    s = clamped(-c / a);
  } else {
    const double cross = a * e - b * b;
    s = cross > tiny * std::max(a, e) ? clamped((b * f - c * e) / cross) : 0;
    t = (b * s + f) / e;
    if (t < 0 || t > 1) {
      t = clamped(t);
      s = clamped((b * t - c) / a);
    }
  }
  return (r + s * d1 - t * d2).norm() - first.radius_m - second.radius_m;
}

std::vector<Contact> contacts_of(const Hand& hand, const geometry::SignedDistanceField& field,
                                 const std::vector<PlacedCapsule>& capsules_O, double contact_m) {
  return nearest_of_links(hand, distances(field, capsules_O), contact_m);
}

ClosedHand close_hand(const Hand& hand, const geometry::SignedDistanceField& field, const Pose& X_OH,
                      const Eigen::VectorXd& q_open, const ClosingRule& rule,
                      std::vector<Eigen::VectorXd>* path) {
  Closing closing(hand, field, X_OH, q_open, rule, path);
  ClosedHand closed;
  closed.q = q_open;
  closed.penetration_m = deepest_m(distances(field, closing.capsules()));
  if (closed.penetration_m > 0) {
    closed.outcome = Closure::blocked_at_start;
    return closed;
  }
  for (auto& groups : groups_of(hand, rule.order.value_or(hand.closing_order)))
    closing.close(std::move(groups));
  closed.q = closing.q();
  const auto all = distances(field, closing.capsules());
  closed.penetration_m = deepest_m(all);
  closed.contacts = nearest_of_links(hand, all, rule.contact_m);
  closed.fingers_touching = fingers_of(hand, closed.contacts);
  return closed;
}

}  // namespace geocage::hands
