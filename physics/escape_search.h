#pragma once
#include <cstdint>
#include <optional>
#include <vector>

#include "physics/escape_test.h"

namespace geocage::physics {

struct EscapeSearchRule {
  int samples = 5000;         ///< random poses that the two trees grow towards
  double step_m = 0.02;       ///< longest edge of a tree: translation plus turn times the object's radius
  double tolerance_m = 5e-4;  ///< a capsule may be that deep on the way
  double recheck_m = 2e-4;    ///< a path that was found is looked at again this densely
};

/// What a search for a way out of the locked hand found. Not finding one is no proof of a cage.
struct EscapeSearch {
  enum class Result {
    found,      ///< `path` leads outside and was checked again, densely
    not_found,  ///< with so many samples
    stuck       ///< the start itself is too deep in the hand
  } result = Result::not_found;
  int samples = 0;
  double path_m = 0;                    ///< length of the translation
  double deepest_m = 0;                 ///< of any capsule on the path, 0 when free
  std::vector<geometry::Pose> path_WO;  ///< from the start on, W the frame of O at the start
  int seeds = 1, found = 0;  ///< searches, and those that found a way: found / seeds is P_esc(samples)
  /// Of all ways found, the least that the centre of mass must be raised against gravity along +x -x +y -y
  /// +z -z of O: an upper bound of the escape energy per weight, u+ / (M g). Empty where none was found.
  std::vector<double> rise_m;
  /// Where the rises were bisected (`lower_rise`): the most that searches were allowed which then found none.
  std::vector<double> unfound_rise_m;
};

/// How high the centre of mass may go against gravity (a unit vector of O at the start), above where it
/// starts.
struct Ceiling {
  geometry::Vec3 gravity_O;
  double rise_m = 0;
};

/// How far the centre of mass (in O) rises at most along the path, against gravity along each of the six
/// axes.
std::vector<double> rises_m(const std::vector<geometry::Pose>& path_WO, const geometry::Vec3& center_O);
/// Searches of one hand by several seeds as one: the first path found, all samples, the lowest rises.
EscapeSearch merged(const std::vector<EscapeSearch>& searches);

/// RRT-Connect (Kuffner and LaValle 2000; OMPL) in SE(3), from the grasp and from 162 poses outside. A motion
/// is looked at by conservative advancement: it may go on by the smallest clearance before the next look. The
/// tolerance grows by what the grasp itself is inside the object, at most 1 mm more: else `stuck`. Same seed,
/// same path. O(samples * capsules) field queries.
EscapeSearch search_escape(const geometry::SignedDistanceField& field, const EscapeTest& escape,
                           const EscapeSearchRule& rule, std::uint64_t seed,
                           const std::optional<Ceiling>& ceiling = {});

/// A bound of the escape energy per weight, u+ / (M g), of one gravity.
struct RiseBound {
  double rise_m = 0;     ///< a way was found that rises so far
  double unfound_m = 0;  ///< no seed found one under this ceiling: evidence, no proof
};

/// Bisects the ceiling between nothing and `rise_m`, that of a way already found, `halvings` times; a level
/// counts as unfound when none of `seeds` searches gets out under it. Never above `rise_m`.
RiseBound lower_rise(const geometry::SignedDistanceField& field, const EscapeTest& escape,
                     const EscapeSearchRule& rule, std::uint64_t seed, int seeds,
                     const geometry::Vec3& gravity_O, double rise_m, int halvings);

}  // namespace geocage::physics
