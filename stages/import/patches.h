#pragma once
#include <vector>

#include "geometry/pose.h"

namespace geocage::stages {

/// Where two patches meet.
struct Border {
  int a, b;           ///< patches
  double length_m;    ///< of the line along which they touch
  double hollow_rad;  ///< angle of the crease between them: positive in a hollow, negative over an edge
};

/// A surface in small pieces, each almost flat.
struct Patches {
  std::vector<int> of_point;  ///< patch of each point
  int count = 0;
  double spacing_m = 0;  ///< median distance of the nearest points
  std::vector<Border> borders;
};

/// A plane through points.
struct Flat {
  geometry::Vec3 middle = geometry::Vec3::Zero();
  geometry::Vec3 normal = geometry::Vec3::Zero();  ///< towards the origin; zero of fewer than eight points
  double off_m = 0;                                ///< deviation from it
};
Flat flat_of(const std::vector<geometry::Vec3>& points);

/// Near points of each point, the nearest 8 within `reach_m`.
std::vector<std::vector<int>> near_points(const std::vector<geometry::Vec3>& points, double reach_m);

/// A crease turns the surface at once, a bend by as much as one looks along it: of planes fitted to the
/// strips of `size_m` and of half of it beside a border, twice the angle of the narrow ones less that of the
/// wide ones is a crease's angle, and 0 of a bend. Patches of `size_m` (supervoxels, Papon et al. 2013, by
/// PCL) of points in a sensor's frame, and where they meet: only where their points are neighbours, so that a
/// jump in depth is no border. `near` is of near_points.
Patches patches_of(const std::vector<geometry::Vec3>& points, const std::vector<std::vector<int>>& near,
                   double size_m);

}  // namespace geocage::stages
