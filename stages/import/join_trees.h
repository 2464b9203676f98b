#pragma once
#include "stages/import/part_graph.h"

namespace geocage::stages {

/// How likely two parts are one thing, by boosted regression trees (Friedman 2001) that were trained on
/// tables of the virtual Kinect: tests/stages/import/train_joins.py makes the numbers.
double probability_of_one(const Evidence& evidence);

}  // namespace geocage::stages
