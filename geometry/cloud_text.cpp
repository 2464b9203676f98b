#include "geometry/cloud_text.h"

#include <array>
#include <cctype>
#include <charconv>
#include <fstream>
#include <string>

#include "pipeline/error.h"

namespace geocage::geometry {

namespace {

using pipeline::Fault;
using pipeline::UserError;

/// A number as the C locale writes it, whatever the locale of this process is.
bool number(std::string_view word, double& value) {
  if (!word.empty() && word.front() == '+') word.remove_prefix(1);
  const auto end = word.data() + word.size();
  const auto read = std::from_chars(word.data(), end, value);
  return !word.empty() && read.ptr == end && read.ec != std::errc::invalid_argument;
}

bool blank(char c) {
  return c == ' ' || c == '\t' || c == '\r';
}

/// "0,5 1,25 2,0" or "0,5;1,25;2,0": commas between digits beside another separator are decimal ones.
bool decimal_commas(const std::string& line) {
  bool inside_number = false, other_separator = false;
  for (std::size_t i = 1; i + 1 < line.size(); ++i) {
    const auto digit = [&](std::size_t k) { return std::isdigit(static_cast<unsigned char>(line[k])) != 0; };
    inside_number = inside_number || (line[i] == ',' && digit(i - 1) && digit(i + 1));
    other_separator = other_separator || line[i] == ';' ||
                      (blank(line[i]) && digit(i - 1) && line.find_first_not_of(" \t\r", i) != line.npos);
  }
  return inside_number && other_separator;
}

/// The first three words of a line; the last ones empty when there are fewer.
std::array<std::string_view, 3> three_words(std::string_view line) {
  std::array<std::string_view, 3> words;
  for (auto& word : words) {
    const auto begin = line.find_first_not_of(" \t\r,;");
    if (begin == line.npos) break;
    line.remove_prefix(begin);
    word = line.substr(0, line.find_first_of(" \t\r,;"));
    line.remove_prefix(word.size());
  }
  return words;
}

}  // namespace

std::vector<Vec3> read_text_points(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::vector<Vec3> points;
  std::string line;
  const auto refuse = [&](int number, const char* what, const char* hint) {
    throw UserError(Fault::input, file.string() + ":" + std::to_string(number), what, hint);
  };
  bool names_may_come = true;
  for (int number_of_line = 1; std::getline(in, line); ++number_of_line) {
    if (number_of_line == 1 && line.starts_with("\xef\xbb\xbf")) line.erase(0, 3);
    const auto words = three_words(line);
    if (words[0].empty() || line[0] == '#' || line.starts_with("//")) continue;
    if (decimal_commas(line))
      refuse(number_of_line, "its numbers have decimal commas", "write them with decimal points");
    Vec3 p;
    const bool good = number(words[0], p.x()) && number(words[1], p.y()) && number(words[2], p.z());
    double unused;
    const bool names = names_may_come && !number(words[0], unused);
    if (!good && !names)
      refuse(number_of_line, "this line holds no three numbers", "x y z, one point a line");
    names_may_come = false;
    if (good) points.push_back(p);
  }
  return points;
}

}  // namespace geocage::geometry
