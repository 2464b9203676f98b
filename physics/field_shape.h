#pragma once
#include <array>
#include <limits>
#include <vector>

#include <BulletCollision/CollisionDispatch/btActivatingCollisionAlgorithm.h>
#include <BulletCollision/CollisionDispatch/btCollisionCreateFunc.h>
#include <BulletCollision/CollisionDispatch/btCollisionDispatcher.h>
#include <BulletCollision/CollisionShapes/btConcaveShape.h>

#include "geometry/distance_field.h"
#include "hands/hand.h"

namespace geocage::physics {

/// A rigid body's shape as a signed distance field: exact topology (holes, cups), one lookup a query. Body
/// frame B may differ from the field's frame O. Collides with capsules only, once FieldCapsuleAlgorithm is
/// registered.
class FieldShape final : public btConcaveShape {
 public:
  /// `field` must outlive the shape. `contact_m`: the gap from which on contacts are made.
  FieldShape(const geometry::SignedDistanceField& field, const geometry::Pose& X_BO, double contact_m);

  const geometry::SignedDistanceField& field() const { return field_; }
  const btTransform& X_BO() const { return X_BO_; }
  double contact_m() const { return contact_m_; }
  void set_contact_m(double gap) { contact_m_ = gap; }

  void getAabb(const btTransform& X_WB, btVector3& low, btVector3& high) const override;
  void processAllTriangles(btTriangleCallback*, const btVector3&, const btVector3&) const override {}
  void calculateLocalInertia(btScalar, btVector3& inertia) const override { inertia.setZero(); }
  void setLocalScaling(const btVector3&) override {}
  const btVector3& getLocalScaling() const override { return scaling_; }
  const char* getName() const override { return "signed distance field"; }

 private:
  const geometry::SignedDistanceField& field_;
  btTransform X_BO_;
  double contact_m_;
  btVector3 scaling_{1, 1, 1};
};

/// A place on a capsule's axis where its surface is near the object's.
struct FieldContact {
  geometry::Vec3 p_O, n_O;  ///< on the axis; outward unit normal of the object
  double value_m;           ///< distance of p_O to the object's surface
};

/// The deepest places, at most as many as a Bullet manifold keeps.
struct FieldContacts {
  static constexpr int capacity = 4;
  std::array<FieldContact, capacity> items;
  int size = 0;
};

/// Of each stretch of the axis whose gap to the object is below `contact_m`: its deepest place, the two ends
/// of the part around it that is as deep, and every other local minimum (samples every 4 mm, refined by
/// parabolas, or golden section at a kink). Where the field has a crease, as between the walls of a groove, a
/// contact for either wall. Normals by central differences over a coarse cell: the interpolant's own gradient
/// jumps at cell faces. O(length) lookups.
FieldContacts field_contacts(const geometry::SignedDistanceField& field,
                             const hands::PlacedCapsule& capsule_O, double contact_m);

/// The same contacts of a capsule that moves: not looked for until its axis has moved by enough for it to
/// come within reach. Keeps to one capsule.
class CapsuleTrack {
 public:
  FieldContacts contacts(const geometry::SignedDistanceField& field, const hands::PlacedCapsule& capsule_O,
                         double contact_m);

 private:
  int last_ = 0;  ///< the last sample of its axis; 0: nothing was looked at yet
  double free_m_ = -std::numeric_limits<double>::infinity();  ///< no value on the axis is smaller
  geometry::Vec3 a_ = geometry::Vec3::Zero(), b_ = geometry::Vec3::Zero();
};

/// Bullet's narrow phase against a FieldShape. Nothing moves fast enough to be looked at between steps.
class FieldAlgorithm : public btActivatingCollisionAlgorithm {
 public:
  using btActivatingCollisionAlgorithm::btActivatingCollisionAlgorithm;
  btScalar calculateTimeOfImpact(btCollisionObject*, btCollisionObject*, const btDispatcherInfo&,
                                 btManifoldResult*) final {
    return 1;
  }

  template <class Algorithm>
  struct Creator final : btCollisionAlgorithmCreateFunc {
    btCollisionAlgorithm* CreateCollisionAlgorithm(btCollisionAlgorithmConstructionInfo& info,
                                                   const btCollisionObjectWrapper* first,
                                                   const btCollisionObjectWrapper* second) override {
      return new (info.m_dispatcher1->allocateCollisionAlgorithm(sizeof(Algorithm)))
          Algorithm(info, first, second);
    }
  };
};

/// Between a capsule, first, and the shape. The capsules of a link are children of a
/// compound, and Bullet asks with the child first, whichever body comes first. The contacts of a step are a
/// function of the poses of that step: nothing is cached from the steps before.
class CapsuleFieldAlgorithm final : public FieldAlgorithm {
 public:
  using Create = Creator<CapsuleFieldAlgorithm>;
  CapsuleFieldAlgorithm(const btCollisionAlgorithmConstructionInfo& info,
                        const btCollisionObjectWrapper* link, const btCollisionObjectWrapper* object);
  ~CapsuleFieldAlgorithm() override;

  void processCollision(const btCollisionObjectWrapper* link, const btCollisionObjectWrapper* object,
                        const btDispatcherInfo&, btManifoldResult* result) override;
  void getAllContactManifolds(btManifoldArray& manifolds) override { manifolds.push_back(manifold_); }

 private:
  btPersistentManifold* manifold_;
};

/// The same between a compound of capsules that never move, in either order, and one FieldShape: without the
/// compound's tree and boxes, and with a track of each capsule.
class LockedHandAlgorithm final : public FieldAlgorithm {
 public:
  using Create = Creator<LockedHandAlgorithm>;
  LockedHandAlgorithm(const btCollisionAlgorithmConstructionInfo& info, const btCollisionObjectWrapper* first,
                      const btCollisionObjectWrapper* second);
  ~LockedHandAlgorithm() override;

  void processCollision(const btCollisionObjectWrapper* first, const btCollisionObjectWrapper* second,
                        const btDispatcherInfo&, btManifoldResult* result) override;
  void getAllContactManifolds(btManifoldArray& manifolds) override;

 private:
  std::vector<CapsuleTrack> tracks_;
  std::vector<btPersistentManifold*> manifolds_;  ///< of each capsule, none until it first touches
};

}  // namespace geocage::physics
