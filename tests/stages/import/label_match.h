#pragma once
#include <algorithm>
#include <map>
#include <vector>

#include "geometry/scene.h"

namespace geocage::tests {

/// How objects of a scene fit the labels of its points, of labels (but 0: no thing) with enough points a
/// centimetre above the table or in an object: a thing that is no object counts as well.
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
  std::vector<char> counts(scene.cloud.size());
  for (std::size_t i = 0; i < counts.size(); ++i)
    counts[i] = scene.cloud.support && scene.cloud.support->height_m(scene.cloud.points[i]) > 0.01;
  LabelMatch match;
  for (std::size_t k = 0; k < scene.objects.size(); ++k) {
    std::map<int, int> labels;
    for (int i : scene.objects[k].points) {
      ++shared[scene.cloud.label[i]][k];
      counts[i] = 1;
      ++labels[scene.cloud.label[i]];
    }
    int most = 0;
    for (const auto& [label, count] : labels)
      if (label != 0) most = std::max(most, count);
    match.points += static_cast<int>(scene.objects[k].points.size());
    match.pure += most;
  }
  for (std::size_t i = 0; i < counts.size(); ++i)
    if (counts[i]) ++total[scene.cloud.label[i]];
  match.objects = static_cast<int>(scene.objects.size());
  std::map<std::size_t, int> main_labels;  // of each object
  for (const auto& [label, count_of_label] : total) {
    if (label == 0 || count_of_label < least_points) continue;
    ++match.labelled;
    int best = 0, large = 0;
    std::size_t where = 0;
    for (const auto& [object, count] : shared[label]) {
      if (count > best) {
        best = count;
        where = object;
      }
      large += count > count_of_label / 4;
    }
    match.split += large > 1;
    if (best > 0) match.merged += main_labels[where]++ > 0;
    match.found += best > 0.75 * count_of_label;
  }
  return match;
}

}  // namespace geocage::tests
