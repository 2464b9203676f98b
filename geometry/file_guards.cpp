#include "geometry/file_guards.h"

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <map>
#include <sstream>

#include "pipeline/error.h"

namespace geocage::geometry {

namespace fs = std::filesystem;
using pipeline::Fault;
using pipeline::UserError;

namespace {

/// Bytes of a PLY number type; 0 for an unknown one.
int size_of_type(const std::string& type) {
  static const std::map<std::string, int> sizes = {
      {"char", 1},  {"uchar", 1},   {"int8", 1},   {"uint8", 1},  {"short", 2}, {"ushort", 2},
      {"int16", 2}, {"uint16", 2},  {"int", 4},    {"uint", 4},   {"int32", 4}, {"uint32", 4},
      {"float", 4}, {"float32", 4}, {"double", 8}, {"float64", 8}};
  const auto it = sizes.find(type);
  return it == sizes.end() ? 0 : it->second;
}

[[noreturn]] void refuse_ply(const fs::path& file, const std::string& sentence) {
  throw UserError(Fault::input, file.string(), sentence, "write the file anew with another tool");
}

}  // namespace

std::string ending_of(const fs::path& file) {
  std::string ending = file.extension();
  std::transform(ending.begin(), ending.end(), ending.begin(),
                 [](unsigned char c) { return std::tolower(c); });
  return ending;
}

void guard_file(const fs::path& file) {
  const auto refuse = [&](const char* sentence, const char* hint) {
    throw UserError(Fault::input, file.string(), sentence, hint);
  };
  std::error_code error;
  const auto type = fs::status(file, error).type();
  if (type == fs::file_type::not_found) refuse("there is no such file", "check the path");
  if (type == fs::file_type::directory) refuse("this is a folder, not a file", "name a file in it");
  if (type != fs::file_type::regular) refuse("this is not a regular file", "copy it into a file first");
  if (fs::file_size(file) == 0) refuse("the file is empty", "write it anew");
  if (!std::ifstream(file)) refuse("the file can't be read", "check its permissions");
}

PlyCounts guard_ply(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::string line, element, format;
  std::map<std::string, std::uint64_t> counts, smallest_row;
  bool ended = false;
  for (int i = 0; i < 1000 && !ended && std::getline(in, line); ++i) {
    if (!line.empty() && line.back() == '\r') line.pop_back();
    if (i == 0 && line != "ply") refuse_ply(file, "this is not a PLY file: it does not begin with 'ply'");
    std::istringstream words(line);
    std::string word, type;
    words >> word;
    ended = word == "end_header";
    if (word == "format") words >> format;
    if (word == "element" && !(words >> element >> counts[element]))
      refuse_ply(file, "its header has a broken line: '" + line.substr(0, 60) + "'");
    if (word == "property" && words >> type) {
      const bool list = type == "list";
      std::string item, name;
      if (list) words >> type >> item >> name;  // an empty list is its count alone,
      const int size = size_of_type(type), item_size = size_of_type(list ? item : type);
      if (size == 0 || item_size == 0)
        refuse_ply(file, "its header names an unknown type: '" + line.substr(0, 60) + "'");
      const bool corners = list && name.starts_with("vertex_ind");  // but a face has three corners
      const int bytes = format == "ascii" ? (corners ? 8 : 2) : size + (corners ? 3 * item_size : 0);
      smallest_row[element] += static_cast<std::uint64_t>(bytes);
    }
  }
  if (!ended) refuse_ply(file, "its header has no end");
  const auto left =
      fs::file_size(file) - static_cast<std::uint64_t>(in.tellg()) + 1;  // the last line may lack its end
  double needed = 0;
  for (const auto& [name, count] : counts)
    needed += static_cast<double>(count) * static_cast<double>(smallest_row[name]);
  if (needed > static_cast<double>(left)) refuse_ply(file, "the file is shorter than its header promises");
  return {counts["vertex"], counts["face"]};
}

namespace {

[[noreturn]] void refuse_pcd(const fs::path& file, const std::string& sentence) {
  throw UserError(Fault::input, file.string(), sentence, "write the file anew with another tool");
}

/// Bytes of a row as the words of SIZE and COUNT give them.
std::uint64_t row_of(const std::string& sizes, const std::string& counts) {
  std::istringstream size_words(sizes), count_words(counts);
  std::uint64_t row = 0, size = 0, count = 0;
  while (size_words >> size) row += size * (count_words >> count ? count : 1);
  return row;
}

}  // namespace

void guard_pcd(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::map<std::string, std::string> header;
  std::string line;
  for (int i = 0; i < 100 && !header.contains("DATA") && std::getline(in, line); ++i) {
    if (!line.empty() && line.back() == '\r') line.pop_back();
    const auto space = line.find(' ');
    header[line.substr(0, space)] = space == std::string::npos ? "" : line.substr(space + 1);
  }
  if (!header.contains("DATA")) refuse_pcd(file, "its header has no DATA line: this is not a PCD file");
  std::string& data = header["DATA"];
  std::istringstream(data) >> data;  // without blanks around it
  if (data != "ascii" && data != "binary" && data != "binary_compressed")
    refuse_pcd(file, "its header names an unknown kind of data: '" + data.substr(0, 20) + "'");
  std::istringstream types(header["TYPE"]);
  for (std::string type; types >> type;)
    if (type != "F" && type != "I" && type != "U")
      refuse_pcd(file, "its header names an unknown type: '" + type.substr(0, 20) + "'");
  const auto number = [&](const char* key) {
    std::uint64_t value = 0;
    std::istringstream(header[key]) >> value;
    return value;
  };
  const std::uint64_t width = number("WIDTH"), height = header.contains("HEIGHT") ? number("HEIGHT") : 1;
  if (number("POINTS") > most_points || width > most_points || height > most_points ||
      width * height > most_points)
    refuse_pcd(file, "its header promises more than 50 million points");
  const std::uint64_t points = std::max(number("POINTS"), width * height);
  const std::uint64_t row = row_of(header["SIZE"], header["COUNT"]);
  if (points > 0 && (row == 0 || row > 65536))
    refuse_pcd(file, "its header gives no sensible size of a point");
  const std::streamoff at = in.tellg();
  const std::uint64_t left = at < 0 ? 0 : fs::file_size(file) - static_cast<std::uint64_t>(at);
  std::uint64_t needed = header["DATA"] == "ascii" ? 2 * points : points * row;
  if (header["DATA"] == "binary_compressed") {
    std::uint32_t packed[2] = {};
    in.read(reinterpret_cast<char*>(packed), sizeof packed);
    needed = sizeof packed + std::uint64_t{packed[0]};
    if (!in || packed[1] != points * row)
      refuse_pcd(file, "what it has packed is not as long as its header promises");
  }
  if (needed > left + 1) refuse_pcd(file, "the file is shorter than its header promises");
  if (header["DATA"] == "ascii") {
    std::uint64_t lines = 0;
    while (lines < points && std::getline(in, line)) lines += line.find_first_not_of(" \t\r") != line.npos;
    if (lines < points)
      refuse_pcd(file, "it holds " + std::to_string(lines) + " of the " + std::to_string(points) +
                           " points that its header promises");
  }
}

void guard_text_mesh(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::string line;
  for (int number = 1; number <= 2000 && std::getline(in, line); ++number) {
    if (line.find('\0') != std::string::npos) return;  // not a text
    if (number == 1 && line.starts_with("\xef\xbb\xbf"))
      throw UserError(Fault::input, file.string(), "it begins with a byte-order mark",
                      "save it as plain UTF-8 without one");
    const auto begin = line.find_first_not_of(" \t");
    if (begin == std::string::npos) continue;
    const std::string_view text = std::string_view(line).substr(begin);
    if (!text.starts_with("v ") && !text.starts_with("vertex ") &&
        text.find_first_not_of("0123456789+-.,eE \t\r") != text.npos)
      continue;
    for (std::size_t i = 1; i + 1 < text.size(); ++i)
      if (text[i] == ',' && std::isdigit(static_cast<unsigned char>(text[i - 1])) &&
          std::isdigit(static_cast<unsigned char>(text[i + 1])))
        throw UserError(Fault::input, file.string() + ":" + std::to_string(number),
                        "its numbers have decimal commas", "write them with decimal points");
  }
}

void guard_stl(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  char head[84] = {};
  in.read(head, sizeof head);
  const auto size = fs::file_size(file);
  std::uint32_t triangles = 0;
  std::memcpy(&triangles, head + 80, 4);
  const bool whole = size >= 84 && size == 84 + 50ull * triangles;
  if (whole) return;
  std::ifstream text(file);
  std::string word, line;
  text >> word;
  bool facet = false, ended = false;
  while (std::getline(text, line) && !ended) {
    facet = facet || line.find("facet") != std::string::npos;
    ended = line.find("endsolid") != std::string::npos;
  }
  if (word != "solid" || !facet)
    throw UserError(Fault::input, file.string(),
                    "this is neither a text STL nor a binary one whose length fits its count of " +
                        std::to_string(triangles) + " triangles",
                    "the file is cut or broken; write it anew");
  if (!ended)
    throw UserError(Fault::input, file.string(), "this text STL has no 'endsolid': it is cut",
                    "write it anew");
}

namespace {

/// The lines of an OFF that say something, cut at comments.
class OffLines {
 public:
  explicit OffLines(const fs::path& file) : in_(file, std::ios::binary) {}
  bool next(std::string& line) {
    while (std::getline(in_, line)) {
      line = line.substr(0, line.find('#'));
      if (line.find_first_not_of(" \t\r") != std::string::npos) return true;
    }
    return false;
  }

 private:
  std::ifstream in_;
};

struct OffCounts {
  long vertices = 0, faces = 0;
};

/// Reads the header; false where it is no text OFF with counts, which the reader will say.
bool off_counts(OffLines& lines, OffCounts& counts) {
  std::string line;
  for (int i = 0; i < 2 && lines.next(line); ++i) {
    if (line.find("BINARY") != std::string::npos) return false;
    std::istringstream words(line);
    std::string word;
    if (line.find("OFF") != std::string::npos) words >> word;  // counts may follow on the same line
    if (words >> counts.vertices >> counts.faces) return true;
  }
  return false;
}

}  // namespace

void guard_off(const fs::path& file) {
  OffLines lines(file);
  OffCounts counts;
  if (!off_counts(lines, counts)) return;
  const auto refuse = [&](const std::string& sentence) {
    throw UserError(Fault::input, file.string(), sentence, "write the file anew with another tool");
  };
  std::string line;
  for (long v = 0; v < counts.vertices; ++v)
    if (!lines.next(line))
      refuse("it ends after " + std::to_string(v) + " of " + std::to_string(counts.vertices) + " vertices");
  for (long f = 0; f < counts.faces; ++f) {
    if (!lines.next(line))
      refuse("it ends after " + std::to_string(f) + " of " + std::to_string(counts.faces) + " faces");
    char* at = line.data();
    const long corners = std::strtol(at, &at, 10);
    for (long k = 0; k < corners; ++k) {
      char* const before = at;
      const long v = std::strtol(at, &at, 10);
      if (at == before) refuse("face " + std::to_string(f) + " has fewer corners than it says");
      if (v < 0 || v >= counts.vertices)
        refuse("face " + std::to_string(f) + " names vertex " + std::to_string(v) + ", but there are " +
               std::to_string(counts.vertices));
    }
  }
}

std::uint64_t declared_faces(const fs::path& file) {
  const std::string ending = ending_of(file);
  if (ending == ".ply") return guard_ply(file).faces;
  std::ifstream in(file, std::ios::binary);
  if (ending == ".stl") {
    char head[84] = {};
    in.read(head, sizeof head);
    std::uint32_t triangles = 0;
    std::memcpy(&triangles, head + 80, 4);
    return fs::file_size(file) == 84 + 50ull * triangles ? triangles : 0;
  }
  if (ending != ".off") return 0;
  OffLines lines(file);
  OffCounts counts;
  return off_counts(lines, counts) && counts.faces > 0 ? static_cast<std::uint64_t>(counts.faces) : 0;
}

std::string ply_with_cr(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::string header, line;
  bool binary = false;
  while (std::getline(in, line) && header.size() < 100000) {
    header += line + "\n";
    binary = binary || line.starts_with("format binary");
    if (line != "end_header") continue;
    if (!binary || in.peek() != '\n') break;
    header.insert(header.size() - 1, "\r");
    std::ostringstream rest;
    rest << in.rdbuf();
    return header + rest.str();
  }
  return {};
}

}  // namespace geocage::geometry
