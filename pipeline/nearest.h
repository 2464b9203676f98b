#pragma once
#include <string>
#include <vector>

namespace geocage::pipeline {

/// The known word with the smallest edit distance (Levenshtein), those that begin with `word` before others,
/// the first of equals; empty when none is known.
std::string nearest_name(const std::string& word, const std::vector<std::string>& known);

/// nearest_name, where it is one that may have been meant: it begins with `word`, or at most two letters in
/// five of the longer of both differ; else empty.
std::string near_name(const std::string& word, const std::vector<std::string>& known);

}  // namespace geocage::pipeline
