#include "hands/closing.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <list>

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

/// The capsules of a hand at one posture, and what each joint moves.
class Posture {
 public:
  Posture(const Hand& hand, const Pose& X_OH, const Eigen::VectorXd& q) : hand_(hand), X_OH_(X_OH), q_(q) {
    place();
  }

  const Eigen::VectorXd& q() const { return q_; }
  const std::vector<PlacedCapsule>& capsules() const { return capsules_; }

  void turn(int dof, double angle) {
    q_[dof] += angle;
    place();
  }

  /// How far any point of a capsule on `link` moves per radian of `dof`, at most; 0 when `dof` does not move
  /// it.
  double lever_m(int dof, int link, const PlacedCapsule& capsule) const {
    double lever = 0;
    for (; link != 0; link = hand_.tree.joints[link - 1].parent_link) {
      const Joint& joint = hand_.tree.joints[link - 1];
      if (joint.type == Joint::Type::fixed || joint.dof != dof) continue;
      const Pose X_OL = X_OH_ * X_HL_[link];
      const Vec3 axis_O = X_OL.linear() * joint.axis_J, p_O = X_OL.translation();
      const double a = axis_O.cross(capsule.a - p_O).norm(), b = axis_O.cross(capsule.b - p_O).norm();
      const double reach = joint.type == Joint::Type::prismatic ? 1 : std::max(a, b) + capsule.radius_m;
      lever += std::abs(joint.multiplier) * reach;
    }
    return lever;
  }

 private:
  void place() {
    forward_kinematics(hand_.tree, q_, X_HL_);
    place_capsules(hand_, X_OH_, X_HL_, capsules_);
  }

  const Hand& hand_;
  Pose X_OH_;
  Eigen::VectorXd q_;
  std::vector<Pose> X_HL_;
  std::vector<PlacedCapsule> capsules_;
};

/// Closes one dof until something touches.
class JointCloser {
 public:
  JointCloser(const Hand& hand, const geometry::SignedDistanceField& field, const Posture& start, int dof)
      : hand_(hand), field_(field), dof_(dof) {
    for (int i = 0; i < static_cast<int>(hand.capsules.size()); ++i) {
      const double lever_m = start.lever_m(dof, hand.capsules[i].link, start.capsules()[i]);
      (lever_m > 0 ? moved_ : others_).push_back(i);
    }
  }

  /// One step; false when the joint stays for good.
  bool step(Posture& posture, double step_rad) const {
    const double direction = hand_.closing_rad[dof_];
    const double limit = direction > 0 ? hand_.tree.upper_rad[dof_] : hand_.tree.lower_rad[dof_];
    double angle = std::min(step_rad, direction * (limit - posture.q()[dof_]));
    if (angle <= 0) return false;
    for (int i : moved_) {
      const double lever_m = posture.lever_m(dof_, hand_.capsules[i].link, posture.capsules()[i]);
      const double free_m = free_distance_m(posture, i, angle * lever_m);
      if (free_m <= touch_m) return false;
      angle = std::min(angle, free_m / lever_m);
    }
    posture.turn(dof_, direction * angle);
    return true;
  }

 private:
  /// Distance of the moved capsule i to the object and to the rest of the hand; what is farther than
  /// `enough_m` need not be exact.
  double free_distance_m(const Posture& posture, int i, double enough_m) const {
    const auto& capsules = posture.capsules();
    const PlacedCapsule& capsule = capsules[i];
    const int parent = hand_.tree.joints[hand_.capsules[i].link - 1].parent_link;  // shares the joint with it
    double free_m = inf;
    for (int other : others_)
      if (hand_.capsules[other].link != parent)
        free_m = std::min(free_m, capsule_gap_m(capsule, capsules[other]));
    const double bound_m = capsule_distance_bound_m(field_, capsule);
    return std::min(free_m, bound_m > enough_m ? bound_m : capsule_distance(field_, capsule).distance_m);
  }

  const Hand& hand_;
  const geometry::SignedDistanceField& field_;
  int dof_;
  std::vector<int> moved_, others_;
};

void close_rank(const Hand& hand, const geometry::SignedDistanceField& field, std::size_t rank,
                double step_rad, Posture& posture) {
  std::list<JointCloser> moving;
  for (const Finger& finger : hand.fingers)
    if (rank < finger.dofs.size()) moving.emplace_back(hand, field, posture, finger.dofs[rank]);
  while (!moving.empty())
    std::erase_if(moving, [&](const JointCloser& joint) { return !joint.step(posture, step_rad); });
}

double deepest_m(const geometry::SignedDistanceField& field, const std::vector<PlacedCapsule>& capsules) {
  double deepest = 0;
  for (const PlacedCapsule& capsule : capsules)
    deepest = std::max(deepest, -capsule_distance(field, capsule).distance_m);
  return deepest;
}

void find_contacts(const Hand& hand, const geometry::SignedDistanceField& field, const Posture& posture,
                   double contact_m, ClosedHand& closed) {
  std::vector<Contact> nearest(hand.tree.links.size(), Contact{.distance_m = inf});
  for (std::size_t i = 0; i < hand.capsules.size(); ++i) {
    const auto at = capsule_distance(field, posture.capsules()[i]);
    Contact& contact = nearest[hand.capsules[i].link];
    if (at.distance_m >= contact.distance_m) continue;
    contact = {hand.capsules[i].link, at.p_O - (at.distance_m + hand.capsules[i].radius_m) * at.n_O, at.n_O,
               at.distance_m};
  }
  const auto touches = [&](int link) { return nearest[link].distance_m <= contact_m; };
  for (const Contact& contact : nearest)
    if (contact.distance_m <= contact_m) closed.contacts.push_back(contact);
  for (const Finger& finger : hand.fingers)
    closed.fingers_touching += std::any_of(finger.links.begin(), finger.links.end(), touches);
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

ClosedHand close_hand(const Hand& hand, const geometry::SignedDistanceField& field, const Pose& X_OH,
                      const Eigen::VectorXd& q_open, const ClosingRule& rule) {
  Posture posture(hand, X_OH, q_open);
  ClosedHand closed;
  closed.q = q_open;
  closed.penetration_m = deepest_m(field, posture.capsules());
  if (closed.penetration_m > 0) {
    closed.outcome = Closure::blocked_at_start;
    return closed;
  }
  std::size_t ranks = 0;
  for (const Finger& finger : hand.fingers) ranks = std::max(ranks, finger.dofs.size());
  for (std::size_t rank = 0; rank < ranks; ++rank) close_rank(hand, field, rank, rule.step_rad, posture);
  closed.q = posture.q();
  closed.penetration_m = deepest_m(field, posture.capsules());
  find_contacts(hand, field, posture, rule.contact_m, closed);
  return closed;
}

}  // namespace geocage::hands
