#pragma once
#include <map>
#include <vector>

#include "geometry/cloud.h"
#include "stages/import/sight.h"

namespace geocage::stages {

/// Parts of a cluster under way, and the reasons for which some are one thing. Points have a name each, of
/// their part; two parts touch where points of theirs are neighbours.
class PartJoins {
 public:
  /// `near`: neighbours of each point of the cluster. All references outlive this.
  PartJoins(const geometry::PointCloud& cloud, const std::vector<int>& cluster, std::vector<int> name,
            const std::vector<std::vector<int>>& near, const Sight& sight, const geometry::Plane& table)
      : cloud_(cloud), cluster_(cluster), name_(std::move(name)), near_(near), sight_(sight), table_(table) {}

  /// A part of fewer points belongs to the neighbour that it touches most.
  void join_fragments(int most_points);
  /// Touching parts without empty space between them are pieces of one convex thing.
  void join_what_is_convex();
  /// What is hollow in itself is the inside of the thing that hides some of it (the far wall of a cup).
  void join_insides();
  /// Most of a part within the convex hull of a neighbour is one with it.
  void join_what_lies_inside();
  /// A thing stands on the table or rests on something level. What hangs at the side of its neighbours (a
  /// handle) is a part of the one that it touches most, and what stands where another thing stands is that
  /// thing.
  void join_what_has_no_stand();
  /// Points that touch nothing, too few for a thing, belong to the nearest part that is one.
  void join_strays(int least_points);

  /// Points of each part as indices into the cloud, in the cluster's order.
  std::vector<std::vector<int>> indices() const;

 private:
  using Sides = std::map<int, int>;  ///< neighbours of a part: pairs of near points
  /// Heights above the table, but for some outliers.
  struct Reach {
    double low_m, high_m;
    double share_of(double height_m) const;
  };
  /// Heights of the points of two parts where they touch.
  struct Contact {
    double middle_m, spread_m;  ///< median, and the distance of the quartiles
  };

  /// What a part rests on: how far it leans from the table, and how far it is from flat.
  struct Carrier {
    double tilt_rad, uneven_m;
  };

  template <class Home>
  void join_while(const Home& home);
  void join_what_floats();
  int home_of(int name, const Sides& sides) const;
  bool rests_on(int name, int other) const;
  bool hides_its_foot(int name) const;
  bool end_alike(int name, int other) const;
  Carrier carrier_of(int name, int other, double height_m) const;
  Contact contact_of(int name, int other) const;
  Reach reach_of(int name) const;
  bool stands(const Reach& reach) const;
  double emptiness(int name, int other) const;

  std::map<int, int> sizes() const;
  std::map<int, Sides> contacts() const;
  void rename(int from, int to);
  std::vector<geometry::Vec3> points_of(int name) const;
  std::vector<geometry::Vec3> seen_points_of(int name) const;

  const geometry::PointCloud& cloud_;
  const std::vector<int>& cluster_;
  std::vector<int> name_;
  const std::vector<std::vector<int>>& near_;
  const Sight& sight_;
  const geometry::Plane& table_;
};

}  // namespace geocage::stages
