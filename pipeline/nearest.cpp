#include "pipeline/nearest.h"

#include <algorithm>
#include <numeric>

namespace geocage::pipeline {

namespace {

std::size_t edit_distance(const std::string& a, const std::string& b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), 0);
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t replace = diagonal + (a[i - 1] != b[j - 1]);
      diagonal = row[j];
      row[j] = std::min({replace, row[j] + 1, row[j - 1] + 1});
    }
  }
  return row[b.size()];
}

}  // namespace

std::string nearest_name(const std::string& word, const std::vector<std::string>& known) {
  const auto rank = [&](const std::string& name) {
    return std::pair(word.empty() || !name.starts_with(word), edit_distance(word, name));
  };
  const auto nearest = std::min_element(known.begin(), known.end(),
                                        [&](const auto& a, const auto& b) { return rank(a) < rank(b); });
  return nearest == known.end() ? "" : *nearest;
}

std::string near_name(const std::string& word, const std::vector<std::string>& known) {
  const std::string name = nearest_name(word, known);
  const bool begins = !word.empty() && name.starts_with(word);
  const std::size_t longer = std::max(word.size(), name.size());
  return begins || 5 * edit_distance(word, name) <= 2 * longer ? name : "";
}

}  // namespace geocage::pipeline
