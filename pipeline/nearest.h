#pragma once
#include <string>
#include <vector>

namespace geocage::pipeline {

<<<<<<< HEAD
/// The known word with the smallest edit distance (Levenshtein), the first of equals; empty when none is known.
=======
/// The known word with the smallest edit distance (Levenshtein), the first of equals; empty when none is
/// known.
>>>>>>> main
std::string nearest_name(const std::string& word, const std::vector<std::string>& known);

}  // namespace geocage::pipeline
