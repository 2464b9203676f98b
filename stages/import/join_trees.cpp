#include "stages/import/join_trees.h"

#include <cmath>

namespace geocage::stages {

namespace {

/// Split n sends what is at most its threshold to 2 n + 1, the rest to 2 n + 2; leaves follow the splits.
template <int splits>
struct TreeOf {
  int feature[splits];
  double threshold[splits], leaf[splits + 1];
};

#include "stages/import/join_trees.inc"

}  // namespace

std::span<const std::string_view> trained_clues() {
  return clues;
}

double probability_of_one(const Evidence& evidence) {
  double log_odds = start;
  for (const Tree& tree : trees) {
    int at = 0;
    while (at < splits) at = 2 * at + (evidence[tree.feature[at]].value <= tree.threshold[at] ? 1 : 2);
    log_odds += tree.leaf[at - splits];
  }
  return 1 / (1 + std::exp(-log_odds));
}

}  // namespace geocage::stages
