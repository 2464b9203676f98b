#pragma once
#include <algorithm>
#include <map>

#include "geometry/scene.h"

namespace geocage::tests {

/// How objects of a scene fit the labels of its points, of labels with enough points above the table.
struct LabelMatch {
  int labelled = 0;  ///< labels
  int found = 0;     ///< that have an object with more than three quarters of their points
  int merged = 0;    ///< whose object has another label already
  int split = 0;     ///< that have more than a quarter of their points in each of two objects
  int objects = 0;
  int points = 0, pure = 0;  ///< of all objects, and of those the points of their object's commonest label
  /// Each label is one object and there is none besides.
  bool one_each() const { return found == labelled && objects == labelled && merged == 0; }
};

inline LabelMatch match_labels(const geometry::Scene& scene, int least_points) {
  std::map<int, std::map<std::size_t, int>> shared;  // label, object: points
  std::map<int, int> total;
  LabelMatch match;
  for (std::size_t k = 0; k < scene.objects.size(); ++k) {
    std::map<int, int> labels;
    for (int i : scene.objects[k].points) {
      ++shared[scene.cloud.label[i]][k];
      ++total[scene.cloud.label[i]];
      ++labels[scene.cloud.label[i]];
    }
    int most = 0;
    for (const auto& [label, count] : labels) most = std::max(most, count);
    match.points += static_cast<int>(scene.objects[k].points.size());
    match.pure += most;
  }
  match.objects = static_cast<int>(scene.objects.size());
  std::map<std::size_t, int> main_labels;  // of each object
  for (const auto& [label, objects] : shared) {
    if (total[label] < least_points) continue;
    ++match.labelled;
    int best = 0, large = 0;
    std::size_t where = 0;
    for (const auto& [object, count] : objects) {
      if (count > best) {
        best = count;
        where = object;
      }
      large += count > total[label] / 4;
    }
    match.split += large > 1;
    match.merged += main_labels[where]++ > 0;
    match.found += best > 0.75 * total[label];
  }
  return match;
}

}  // namespace geocage::tests
