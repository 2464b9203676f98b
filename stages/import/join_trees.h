#pragma once
#include <span>
#include <string_view>

#include "stages/import/part_graph.h"

namespace geocage::stages {

/// How likely two parts are one thing, by boosted regression trees (Friedman 2001) that were trained on
/// tables of the virtual Kinect: tests/stages/import/train_joins.py makes the numbers.
/// Precondition: clues as trained_clues() names them.
double probability_of_one(const Evidence& evidence);

/// Names of the clues that the trees ask, in the order of the evidence that they were trained on.
std::span<const std::string_view> trained_clues();

}  // namespace geocage::stages
