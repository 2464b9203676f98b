#pragma once
#include <vector>

#include "geometry/mesh.h"

namespace geocage::topology {

/// Spearman's rank correlation of two fields over the vertices where both are finite; equal values share
/// their mean rank. NaN where a field is constant, or fewer than two vertices are left. O(n log n).
double rank_correlation(const std::vector<double>& first, const std::vector<double>& second);

/// Indices of the largest `share` of the finite values, ascending. All that equal the smallest one taken are
/// taken too, so that no tie is cut by index: more than `share` where many are equal. O(n log n).
std::vector<int> top_set(const std::vector<double>& values, double share);

/// Vertices where a field is largest, ascending; none when it has no value.
std::vector<int> largest(const std::vector<double>& values);

/// Way along edges from the nearest of `sources` to every vertex [m]; infinite where none leads. O(n log n).
std::vector<double> ways_from(const std::vector<int>& sources, const geometry::TriangleMesh& mesh);

/// Jaccard index of two ascending sets: common over all. 1 for two empty ones.
double overlap(const std::vector<int>& first, const std::vector<int>& second);

}  // namespace geocage::topology
