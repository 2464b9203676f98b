#pragma once
#include <map>
#include <string_view>
#include <utility>
#include <vector>

#include "geometry/cloud.h"
#include "stages/import/parts.h"
#include "stages/import/patches.h"
#include "stages/import/sight.h"

namespace geocage::stages {

/// Something seen of two parts that tells whether they are one thing.
struct Clue {
  std::string_view name;
  double value;  ///< metres, radians or a share, as the name says; heights are above the table
};
/// The same clues in the same order for any two parts; a is the one with fewer points.
using Evidence = std::vector<Clue>;

/// A cluster in parts, which touch, hide each other, and join.
class PartGraph {
 public:
  using Pair = std::pair<int, int>;  ///< names of two parts, the smaller number first

  /// Almost flat patches become parts by a multicut (multicut.h) of the borders between them: too many
  /// rather than too few. All references outlive this. Precondition: as of parts_by_shape.
  PartGraph(const geometry::PointCloud& cloud, const Sight& sight, const std::vector<int>& cluster,
            const geometry::Plane& table, const PartRule& rule);

  /// Parts that lie within most_gap_m of each other, ascending.
  std::vector<Pair> pairs() const;
  Evidence evidence(const Pair& pair) const;
  /// The second becomes one with the first.
  void join(const Pair& pair);
  /// Points of each part by its name, as indices into the cloud, in the cluster's order.
  std::map<int, std::vector<int>> parts() const;
  /// How many points each part has.
  std::map<int, int> sizes() const;

 private:
  using Points = std::vector<geometry::Vec3>;
  /// How far points reach in each of many directions.
  using Outline = std::vector<double>;
  struct Part {
    Points points, seen;  ///< in the cloud's frame, and from the sensor along the cloud's axes
    geometry::Vec3 middle, normal;
    double flat_m;         ///< deviation from a plane
    double low_m, high_m;  ///< but for some outliers
    double hollow;         ///< emptiness between its own points
    double foot_seen;      ///< share of its lowest points below which the table was seen
    Outline hull, foot;    ///< all round, and along the table
    Sight::Front front;
    double turned_m;  ///< see Turned
    Eigen::Vector2d axis_m;
    double boxed_m;  ///< boxed.h
    double share_of(double height_m) const;
  };
  /// Where two parts touch: near points of both, by pairs; else how far they are from each other.
  struct Contact {
    Points of_first, of_second;
    double gap_m = 0, gap_height_m = 0;
  };
  struct Touch {
    double middle_m, spread_m;  ///< heights: median, and the distance of the quartiles
  };
  /// Of all borders of patches between two parts: length, and the mean bond and crease.
  struct Seam {
    double length_m = 0, bond = 0, crease_rad = 0;
  };

  void cut(const Points& seen);
  Part part_of(const std::vector<int>& members) const;
  void find_contacts();
  Touch touch_of(const Contact& contact) const;
  Seam seam_of(const Pair& pair) const;
  double hold_of(int name, const Contact& contact) const;
  double lean_of(const geometry::Vec3& normal) const;
  std::pair<double, double> carrier(const Part& under, const Points& touching, double height_m) const;

  const geometry::PointCloud& cloud_;
  const std::vector<int>& cluster_;
  const geometry::Plane table_;
  const PartRule rule_;
  const Sight& sight_;
  const Points round_, level_;  ///< directions of outlines
  std::vector<std::vector<int>> near_;
  Patches patches_;
  std::vector<int> of_patch_;  ///< part of each patch
  std::map<int, Part> parts_;
  std::map<Pair, Contact> contacts_;
};

}  // namespace geocage::stages
