#include "physics/field_shape.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <new>

#include "physics/bullet_eigen.h"
#include <BulletCollision/BroadphaseCollision/btDispatcher.h>
#include <BulletCollision/CollisionDispatch/btCollisionObjectWrapper.h>
#include <BulletCollision/CollisionDispatch/btManifoldResult.h>
#include <BulletCollision/CollisionShapes/btCapsuleShape.h>
#include <BulletCollision/CollisionShapes/btCompoundShape.h>

namespace geocage::physics {
namespace {

using geometry::SignedDistanceField;
using geometry::Vec3;

constexpr double sample_m = 0.004;
constexpr double same_gap_m = 5e-5;  // of contacts that share a load: the error of a good field
constexpr double golden = 0.6180339887498949;

/// The axis a + t (b - a), t in [0, 1], as a line of field values.
struct AxisLine {
  const SignedDistanceField& field;
  Vec3 a, ab;
  Vec3 point(double t) const { return a + t * ab; }
  double value(double t) const { return field.value(point(t)); }
};

/// A place of the line, and the value there.
struct Place {
  double t, value;
};

/// The lowest place between `low` and `high`, where `middle`, between them or one of them, is the lowest
/// known: the vertex of the parabola through the three, then through what was found there, as soon as a look
/// agrees with its parabola to 5 um, a tenth of what a good field is off. A kink has no parabola: golden
/// section, to 1 % of the first way between the two.
Place lowest(const AxisLine& line, Place low, Place middle, Place high) {
  constexpr double sure_m = 5e-6;
  const double narrow = 0.01 * (high.t - low.t);
  const auto look_at = [&](double t) {
    const Place seen{t, line.value(t)};
    if (seen.value > middle.value)
      (t < middle.t ? low : high) = seen;
    else
      (t < middle.t ? high : low) = middle, middle = seen;
    return seen;
  };
  for (int look = 0; look < 2; ++look) {  // does it fall from the end of the line inward?
    if (middle.t == low.t)
      look_at(low.t + 0.1 * (high.t - low.t));
    else if (middle.t == high.t)
      look_at(high.t - 0.1 * (high.t - low.t));
  }
  if (middle.t == low.t || middle.t == high.t) return middle;
  for (int look = 0; look < 10 && high.t - low.t > narrow; ++look) {
    const double l = middle.t - low.t, r = high.t - middle.t;
    const double a = low.value - middle.value, b = high.value - middle.value;
    if (std::max(a, b) < sure_m) break;
    const double curve = a * r + b * l, slope = b * l * l - a * r * r;  // both times l r (l + r)
    if (look > 1) {
      look_at(l > r ? middle.t - (1 - golden) * l : middle.t + (1 - golden) * r);
      continue;
    }
    const double told = middle.value - slope * slope / (4 * curve * l * r * (l + r));
    if (std::abs(look_at(middle.t - 0.5 * slope / curve).value - told) < sure_m) break;
  }
  return middle;
}

/// Central differences over `h_m`, as a slope: of norm 1 but where walls meet.
Vec3 slope_at(const SignedDistanceField& field, const Vec3& p, double h_m) {
  Vec3 slope;
  for (int axis = 0; axis < 3; ++axis) {
    const Vec3 h = h_m * Vec3::Unit(axis);
    slope[axis] = (field.value(p + h) - field.value(p - h)) / (2 * h_m);
  }
  return slope;
}

/// Central differences over a coarse cell. A cylinder's surface has no normal along its axis, so between the
/// caps that part goes: it would let the edge of a flat face push a rail along itself.
Vec3 outward_normal(const AxisLine& line, double t, const Vec3& slope) {
  const Vec3 u = line.ab.stableNormalized();
  const double along = slope.dot(u);
  const bool on_cap = (t == 0 && along > 0) || (t == 1 && along < 0);
  return (on_cap ? slope : Vec3(slope - along * u)).stableNormalized();
}

/// Field values along the axis, every 4 mm or so.
struct Samples {
  static constexpr int most = 127;
  std::array<double, most + 1> value;  ///< infinite: not looked at
  int last = 0;
  double t(int i) const { return static_cast<double>(i) / last; }
  Place at(const AxisLine& line, int i) const {
    return {t(i), std::isfinite(value[i]) ? value[i] : line.value(t(i))};
  }
  Place lowest_around(const AxisLine& line, int i) const {
    return lowest(line, at(line, std::max(0, i - 1)), at(line, i), at(line, std::min(last, i + 1)));
  }
};

/// The deepest are kept: a new contact takes the place of the shallowest one when there is no room.
void keep(FieldContacts& contacts, const FieldContact& contact) {
  if (contacts.size < FieldContacts::capacity) {
    contacts.items[contacts.size++] = contact;
    return;
  }
  auto shallowest = std::ranges::max_element(contacts.items, {}, &FieldContact::value_m);
  if (contact.value_m < shallowest->value_m) *shallowest = contact;
}

/// In a groove the axis is as near to one wall as to the other: the field has a crease there, and a normal
/// that points from one wall in one step and from the other in the next lets the finger through both. The
/// slopes a coarse cell to either side tell of one wall each; as planes they are two contacts at the same
/// place.
bool keep_walls(FieldContacts& contacts, const AxisLine& line, const Place& place, const Vec3& slope,
                double reach) {
  constexpr double crease = 0.85,
                   apart = 0.9;  // |slope| of walls 63 degrees apart; cosine of normals that differ
  if (slope.norm() > crease) return false;
  const double h = line.field.cell_m;
  const auto [t, nearest] = place;
  const Vec3 p = line.point(t), along = line.ab.stableNormalized();
  Vec3 across = along.cross(slope);
  if (across.norm() < 1e-3) across = along.unitOrthogonal();
  across.normalize();
  FieldContact walls[2];
  for (int side = 0; side < 2; ++side) {
    const Vec3 beside = p + (side == 0 ? h : -h) * across;
    const Vec3 wall = slope_at(line.field, beside, h / 2);
    const double gap = line.field.value(beside) - wall.dot(beside - p);
    walls[side] = {p, outward_normal(line, t, wall), std::max(gap, nearest)};
  }
  if (walls[0].n_O.dot(walls[1].n_O) > apart) return false;
  // Planes that leave out what is nearest are not the walls: there are more than two, or they are bent.
  if (std::min(walls[0].value_m, walls[1].value_m) > nearest + same_gap_m)
    keep(contacts, {p, outward_normal(line, t, slope), nearest});
  for (const FieldContact& wall : walls)
    if (wall.value_m < reach) keep(contacts, wall);
  return true;
}

void keep_at(FieldContacts& contacts, const AxisLine& line, const Place& place, double reach) {
  const Vec3 p = line.point(place.t), slope = slope_at(line.field, p, line.field.cell_m);
  if (keep_walls(contacts, line, place, slope, reach)) return;
  keep(contacts, {p, outward_normal(line, place.t, slope), place.value});
}

/// Contacts of the samples [first, last], all within reach: the deepest place, how far to both sides the gap
/// stays the same, without which a flat face would rock on a single point, and every other place deeper than
/// those beside it.
void add_stretch(const AxisLine& line, const Samples& samples, int first, int last, double reach,
                 FieldContacts& contacts) {
  const auto& value = samples.value;
  const int deepest = static_cast<int>(std::min_element(&value[first], &value[last] + 1) - value.data());
  const double same = value[deepest] + same_gap_m;
  int left = deepest, right = deepest;
  while (left > first && value[left - 1] <= same) --left;
  while (right < last && value[right + 1] <= same) ++right;

  keep_at(contacts, line, samples.lowest_around(line, deepest), reach);
  if (left != deepest) keep_at(contacts, line, samples.at(line, left), reach);
  if (right != deepest) keep_at(contacts, line, samples.at(line, right), reach);
  // In a hollow a finger touches with several places at once, none as deep as another by a hair: each is a
  // wall.
  for (int i = first; i <= last; ++i) {
    if (i >= left && i <= right) continue;
    const bool falls = i > first ? value[i] < value[i - 1] : i == 0;
    const bool rises = i < last ? value[i] <= value[i + 1] : i == samples.last;
    if (!falls || !rises) continue;
    keep_at(contacts, line, samples.lowest_around(line, i), reach);
  }
}

FieldContacts contacts_of(const AxisLine& line, const Samples& samples, double reach) {
  FieldContacts contacts;
  for (int i = 0; i <= samples.last; ++i) {
    if (samples.value[i] >= reach) continue;
    const int first = i;
    while (i < samples.last && samples.value[i + 1] < reach) ++i;
    add_stretch(line, samples, first, i, reach, contacts);
  }
  return contacts;
}

/// Into the manifold between the capsule's body and the object, in that order.
void put(const FieldContacts& contacts, double radius_m, const btTransform& X_WO, btManifoldResult& result) {
  for (int i = 0; i < contacts.size; ++i) {
    const FieldContact& contact = contacts.items[i];
    const btVector3 n_W = X_WO.getBasis() * bullet(contact.n_O);
    const btVector3 on_object = X_WO * bullet(contact.p_O) - contact.value_m * n_W;
    result.addContactPoint(n_W, on_object, contact.value_m - radius_m);
  }
}

hands::PlacedCapsule placed(const btCapsuleShape& capsule, const btTransform& X_OC) {
  btVector3 half(0, 0, 0);
  half[capsule.getUpAxis()] = capsule.getHalfHeight();
  return {eigen(X_OC * -half), eigen(X_OC * half), capsule.getRadius()};
}

}  // namespace

FieldContacts field_contacts(const SignedDistanceField& field, const hands::PlacedCapsule& capsule_O,
                             double contact_m) {
  return CapsuleTrack().contacts(field, capsule_O, contact_m);
}

/// Outside its grid the field may rise by 2 m a metre, never faster: what the samples said rules out contacts
/// until the capsule has moved by half of it.
FieldContacts CapsuleTrack::contacts(const SignedDistanceField& field, const hands::PlacedCapsule& capsule_O,
                                     double contact_m) {
  const AxisLine line{field, capsule_O.a, capsule_O.b - capsule_O.a};
  const double reach = capsule_O.radius_m + contact_m;
  // No point of the axis moves farther than its ends.
  free_m_ -= 2 * std::max((capsule_O.a - a_).norm(), (capsule_O.b - b_).norm());
  a_ = capsule_O.a, b_ = capsule_O.b;
  if (free_m_ > reach) return {};
  if (last_ == 0)
    last_ = std::clamp(static_cast<int>(std::ceil(line.ab.norm() / sample_m)), 1, Samples::most);

  Samples samples;
  samples.last = last_;
  std::array<float, Samples::most + 1> bound;
  field.bounds_along(line.a, line.ab, last_, bound);
  free_m_ = std::numeric_limits<double>::infinity();
  for (int i = 0; i <= last_; ++i) {
    const double least = bound[i] < reach ? line.value(samples.t(i)) : bound[i];
    samples.value[i] = bound[i] < reach ? least : std::numeric_limits<double>::infinity();
    free_m_ = std::min(free_m_, least);
  }
  return contacts_of(line, samples, reach);
}

FieldShape::FieldShape(const SignedDistanceField& field, const geometry::Pose& X_BO, double contact_m)
    : field_(field), X_BO_(bullet(X_BO)), contact_m_(contact_m) {
  m_shapeType = CUSTOM_CONCAVE_SHAPE_TYPE;
}

void FieldShape::getAabb(const btTransform& X_WB, btVector3& low, btVector3& high) const {
  const Vec3 half = 0.5 * field_.cell_m * Vec3(field_.nodes[0] - 1, field_.nodes[1] - 1, field_.nodes[2] - 1);
  const btTransform X_WO = X_WB * X_BO_;
  const btVector3 center = X_WO * bullet(Vec3(field_.origin + half));
  const btVector3 extent = bullet(half).dot3(X_WO.getBasis()[0].absolute(), X_WO.getBasis()[1].absolute(),
                                             X_WO.getBasis()[2].absolute());
  low = center - extent, high = center + extent;
}

CapsuleFieldAlgorithm::CapsuleFieldAlgorithm(const btCollisionAlgorithmConstructionInfo& info,
                                             const btCollisionObjectWrapper* link,
                                             const btCollisionObjectWrapper* object)
    : FieldAlgorithm(info, link, object),
      manifold_(m_dispatcher->getNewManifold(link->getCollisionObject(), object->getCollisionObject())) {}

CapsuleFieldAlgorithm::~CapsuleFieldAlgorithm() {
  m_dispatcher->releaseManifold(manifold_);
}

void CapsuleFieldAlgorithm::processCollision(const btCollisionObjectWrapper* link,
                                             const btCollisionObjectWrapper* object, const btDispatcherInfo&,
                                             btManifoldResult* result) {
  const auto& shape = static_cast<const FieldShape&>(*object->getCollisionShape());
  const auto& capsule = static_cast<const btCapsuleShape&>(*link->getCollisionShape());
  const btTransform X_WO = object->getWorldTransform() * shape.X_BO();
  const btTransform X_OC = X_WO.inverseTimes(link->getWorldTransform());
  manifold_->clearManifold();
  manifold_->setContactBreakingThreshold(shape.contact_m());
  result->setPersistentManifold(manifold_);
  put(field_contacts(shape.field(), placed(capsule, X_OC), shape.contact_m()), capsule.getRadius(), X_WO,
      *result);
}

LockedHandAlgorithm::LockedHandAlgorithm(const btCollisionAlgorithmConstructionInfo& info,
                                         const btCollisionObjectWrapper* first,
                                         const btCollisionObjectWrapper* second)
    : FieldAlgorithm(info, first, second) {
  const btCollisionObjectWrapper* hand = first->getCollisionShape()->isCompound() ? first : second;
  const auto capsules = static_cast<const btCompoundShape*>(hand->getCollisionShape())->getNumChildShapes();
  tracks_.resize(capsules), manifolds_.resize(capsules);
}

LockedHandAlgorithm::~LockedHandAlgorithm() {
  for (btPersistentManifold* manifold : manifolds_)
    if (manifold) m_dispatcher->releaseManifold(manifold);
}

void LockedHandAlgorithm::processCollision(const btCollisionObjectWrapper* first,
                                           const btCollisionObjectWrapper* second, const btDispatcherInfo&,
                                           btManifoldResult* result) {
  const bool hand_first = first->getCollisionShape()->isCompound();
  const btCollisionObjectWrapper &hand = hand_first ? *first : *second,
                                 &object = hand_first ? *second : *first;
  const auto& shape = static_cast<const FieldShape&>(*object.getCollisionShape());
  const auto& capsules = static_cast<const btCompoundShape&>(*hand.getCollisionShape());
  const btTransform X_WO = object.getWorldTransform() * shape.X_BO();
  const btTransform X_OH = X_WO.inverseTimes(hand.getWorldTransform());
  for (int i = 0; i < capsules.getNumChildShapes(); ++i) {
    const auto& capsule = static_cast<const btCapsuleShape&>(*capsules.getChildShape(i));
    const FieldContacts contacts = tracks_[i].contacts(
        shape.field(), placed(capsule, X_OH * capsules.getChildTransform(i)), shape.contact_m());
    btPersistentManifold*& manifold = manifolds_[i];
    if (manifold) manifold->clearManifold();
    if (contacts.size == 0) continue;
    if (!manifold)
      manifold = m_dispatcher->getNewManifold(hand.getCollisionObject(), object.getCollisionObject());
    manifold->setContactBreakingThreshold(shape.contact_m());
    result->setPersistentManifold(manifold);
    put(contacts, capsule.getRadius(), X_WO, *result);
  }
}

void LockedHandAlgorithm::getAllContactManifolds(btManifoldArray& manifolds) {
  for (btPersistentManifold* manifold : manifolds_)
    if (manifold) manifolds.push_back(manifold);
}

}  // namespace geocage::physics
