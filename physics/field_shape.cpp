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

/// Where the line's value is smallest in [low, high], to (high - low) * golden^10 < 1 %.
double smallest(const AxisLine& line, double low, double high) {
  double left = high - golden * (high - low), right = low + golden * (high - low);
  double at_left = line.value(left), at_right = line.value(right);
  for (int step = 0; step < 9; ++step) {
    if (at_left <= at_right) {
      high = right, right = left, at_right = at_left;
      left = high - golden * (high - low), at_left = line.value(left);
    } else {
      low = left, left = right, at_left = at_right;
      right = low + golden * (high - low), at_right = line.value(right);
    }
  }
  return 0.5 * (low + high);
}

/// Central differences over a coarse cell. A cylinder's surface has no normal along its axis, so between the
/// caps that part goes: it would let the edge of a flat face push a rail along itself.
Vec3 outward_normal(const AxisLine& line, double t) {
  Vec3 slope;
  for (int axis = 0; axis < 3; ++axis) {
    const Vec3 h = line.field.cell_m * Vec3::Unit(axis);
    slope[axis] = line.field.value(line.point(t) + h) - line.field.value(line.point(t) - h);
  }
  const Vec3 u = line.ab.stableNormalized();
  const double along = slope.dot(u);
  const bool on_cap = (t == 0 && along > 0) || (t == 1 && along < 0);
  return (on_cap ? slope : Vec3(slope - along * u)).stableNormalized();
}

/// Field values along the axis, every 4 mm or so.
struct Samples {
  static constexpr int most = 127;
  std::array<double, most + 1> value;
  int last = 0;
  double step() const { return 1.0 / last; }
};

/// Where the field is too large for a contact, the samples that it rules out are skipped: outside its grid it
/// may rise by 2 m a metre, never faster.
Samples sample(const AxisLine& line, double reach) {
  Samples samples;
  const double length = line.ab.norm();
  samples.last = std::clamp(static_cast<int>(std::ceil(length / sample_m)), 1, Samples::most);
  std::fill_n(samples.value.begin(), samples.last + 1, std::numeric_limits<double>::infinity());
  for (int i = 0; i <= samples.last;) {
    samples.value[i] = line.value(i * samples.step());
    const double spare = (samples.value[i] - reach) / 2;
    i += std::max(1,
                  static_cast<int>(std::min(spare / (length * samples.step() + 1e-12), 1.0 * Samples::most)));
  }
  return samples;
}

/// Keeps the deepest: a new contact takes the place of the shallowest one when there is no room.
void keep(FieldContacts& contacts, const AxisLine& line, double t) {
  const FieldContact contact{line.point(t), outward_normal(line, t), line.value(t)};
  if (contacts.size < FieldContacts::capacity) {
    contacts.items[contacts.size++] = contact;
    return;
  }
  auto shallowest = std::ranges::max_element(contacts.items, {}, &FieldContact::value_m);
  if (contact.value_m < shallowest->value_m) *shallowest = contact;
}

/// Contacts of the samples [first, last], all within reach: the deepest place, and how far to both sides the
/// gap stays the same, without which a flat face would rock on a single point.
void add_stretch(const AxisLine& line, const Samples& samples, int first, int last, FieldContacts& contacts) {
  const auto& value = samples.value;
  const int deepest = static_cast<int>(std::min_element(&value[first], &value[last] + 1) - value.data());
  const double step = samples.step(), same = value[deepest] + same_gap_m;
  int left = deepest, right = deepest;
  while (left > first && value[left - 1] <= same) --left;
  while (right < last && value[right + 1] <= same) ++right;

  const double refined =
      smallest(line, std::max(0, deepest - 1) * step, std::min(samples.last, deepest + 1) * step);
  keep(contacts, line, line.value(refined) < value[deepest] ? refined : deepest * step);
  if (left != deepest) keep(contacts, line, left * step);
  if (right != deepest) keep(contacts, line, right * step);
}

}  // namespace

FieldContacts field_contacts(const SignedDistanceField& field, const hands::PlacedCapsule& capsule_O,
                             double contact_m) {
  FieldContacts contacts;
  const AxisLine line{field, capsule_O.a, capsule_O.b - capsule_O.a};
  const double reach = capsule_O.radius_m + contact_m;
  // Outside its grid the field may rise by 2 m a metre, never faster.
  if (line.value(0.5) > reach + line.ab.norm()) return contacts;

  const Samples samples = sample(line, reach);
  for (int i = 0; i <= samples.last; ++i) {
    if (samples.value[i] >= reach) continue;
    const int first = i;
    while (i < samples.last && samples.value[i + 1] < reach) ++i;
    add_stretch(line, samples, first, i, contacts);
  }
  return contacts;
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
    : btActivatingCollisionAlgorithm(info, link, object),
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
  btVector3 half(0, 0, 0);
  half[capsule.getUpAxis()] = capsule.getHalfHeight();
  const double radius = capsule.getRadius();

  manifold_->clearManifold();
  manifold_->setContactBreakingThreshold(shape.contact_m());
  result->setPersistentManifold(manifold_);
  const FieldContacts contacts =
      field_contacts(shape.field(), {eigen(X_OC * -half), eigen(X_OC * half), radius}, shape.contact_m());
  for (int i = 0; i < contacts.size; ++i) {
    const FieldContact& contact = contacts.items[i];
    const btVector3 n_W = X_WO.getBasis() * bullet(contact.n_O);
    const btVector3 on_object = X_WO * bullet(contact.p_O) - contact.value_m * n_W;
    result->addContactPoint(n_W, on_object, contact.value_m - radius);
  }
}

btCollisionAlgorithm* CapsuleFieldAlgorithm::Create::CreateCollisionAlgorithm(
    btCollisionAlgorithmConstructionInfo& info, const btCollisionObjectWrapper* link,
    const btCollisionObjectWrapper* object) {
  void* memory = info.m_dispatcher1->allocateCollisionAlgorithm(sizeof(CapsuleFieldAlgorithm));
  return new (memory) CapsuleFieldAlgorithm(info, link, object);
}

}  // namespace geocage::physics
